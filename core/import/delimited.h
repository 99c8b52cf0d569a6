#pragma once
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/import/recording.h"

namespace unrig {

/// How a text table is written. What is left empty is found out.
struct DelimitedFormat {
  std::string delimiter;       ///< one character, or "blanks" for any number of blanks; empty: what the first row has: tab, ; or |, else a comma, else blanks
  std::string decimal;         ///< "." or ","; empty: a comma where it is no delimiter, a number shows one, and none shows a point (DecimalSign), else a point
  int skip_lines = 0;          ///< before the header, or before the numbers where there is no header; 0: titles, lines of fewer cells than the table below them, are found out and warned of
  std::optional<bool> header;  ///< whether a row of names comes first; empty: it does, unless that row holds nothing but numbers
  std::string thousands{};     ///< what sets off groups of three digits: "." "," " " or "'"; empty: nothing does
  std::vector<std::string> missing{};  ///< cells that mean a missing sample: "ERR", "#N/A"
};

/// Reads a table of numbers in text. A header names the columns, with the unit in brackets or parentheses ("Force [N]", "Force (N)") or all units in a row of
/// their own below it; without one the remark right before the numbers does where it has as many words as they have columns (NumPy writes such), else
/// they are "1", "2", ... Cells that are empty or nan are missing; lines that begin with # or % are left out, but for a cell such as #N/A. Lines end with LF,
/// CR LF, or CR alone.
///
/// A column of time stamps (core/import/time_stamp.h) becomes seconds since its first. A column with a cell of text in it, one without a cell, and one that some
/// rows end before are left out; their names stand in Recording::left_out.
/// Throws InputError, with the line, for rows with more cells than there are columns or fewer than columns of numbers, and where no row or no column is left.
Recording read_delimited(std::string_view text, const std::string& file, const DelimitedFormat& format = {});

/// The text in UTF-8: out of UTF-16 where it begins with that encoding's mark, out of Latin-1 where it is no UTF-8 (degree signs of older programs).
std::string in_utf8(std::string text);

}  // namespace unrig
