#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "core/import/recording.h"

namespace unrig {

/// The channels of a real MATLAB matrix of that size, its numbers column by column: a vector is one channel called `name`, the columns of a matrix are
/// "name(:,1)", "name(:,2)", .... A matrix with more columns than rows stands on its side, as a recording has more samples than channels: its rows are
/// "name(1,:)", "name(2,:)", .... Integers count as unscaled readings of a converter. What is no vector or matrix, or empty, is left out with a warning.
void add_matrix(const std::string& name, const std::vector<std::size_t>& size, bool integers, const std::vector<double>& numbers, Recording& out);

/// A cell array of texts.
struct NamedTexts {
  std::string name;
  std::vector<std::string> texts;
};

/// Gives the columns of a matrix the names, and units, that stand in a list beside it: in the same structure, or among the variables, with as many texts as it has
/// channels. A list whose name has "unit" in it holds units. Where two lists may hold the names, none does.
void name_columns(const std::vector<NamedTexts>& lists, Recording& out);

/// UTF-8 of UTF-16 code units; what lies beyond 16 bits becomes "?".
std::string text_of_units(const std::vector<std::uint16_t>& units);

/// Says that a variable is left out. Where there are very many, the rest is not told.
void leave_out(const std::string& name, const std::string& why, Recording& out);

/// "name.field", in an array of structures "name(2).field".
std::string field_name(const std::string& name, std::size_t element, std::size_t elements, const std::string& field);

constexpr int deepest_structure = 8;
constexpr std::size_t most_structures = 10000;  ///< in an array of them

}  // namespace unrig
