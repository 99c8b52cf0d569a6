#pragma once
#include <string>
#include <vector>

#include "core/import/recording.h"

namespace unrig {

/// The channels of a real MATLAB matrix of that size, its numbers column by column: a vector is one channel called `name`, the columns of a matrix are
/// "name(:,1)", "name(:,2)", .... Integers count as unscaled readings of a converter. What is no vector or matrix, or empty, is left out with a warning.
void add_matrix(const std::string& name, const std::vector<std::size_t>& size, bool integers, const std::vector<double>& numbers, Recording& out);

/// Says that a variable is left out. Where there are very many, the rest is not told.
void leave_out(const std::string& name, const std::string& why, Recording& out);

/// "name.field", in an array of structures "name(2).field".
std::string field_name(const std::string& name, std::size_t element, std::size_t elements, const std::string& field);

constexpr int deepest_structure = 8;
constexpr std::size_t most_structures = 10000;  ///< in an array of them

}  // namespace unrig
