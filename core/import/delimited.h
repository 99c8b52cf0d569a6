#pragma once
#include <string>
#include <string_view>

#include "core/import/recording.h"

namespace unrig {

/// How a text table is written. What is left empty is found out.
struct DelimitedFormat {
  std::string delimiter;      ///< one character, or "blanks" for any number of blanks; empty: what the header row has most of among tab ; , and blanks
  std::string decimal = ".";  ///< or ","
  int skip_lines = 0;         ///< before the header, or before the numbers where there is no header
  bool header = true;
};

/// Reads a table of numbers in text. A header names the columns, with the unit in brackets or parentheses ("Force [N]", "Force (N)"); without one
/// they are "1", "2", ... Cells that are empty or nan are missing; lines that begin with # or % are left out.
/// Throws InputError, with the line, for text where a number should stand, rows of another length than the first, and what has no rows.
Recording read_delimited(std::string_view text, const std::string& file, const DelimitedFormat& format = {});

}  // namespace unrig
