#pragma once
#include <Eigen/Core>
#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "core/files/error.h"

namespace unrig {

/// One column as it stands in the file.
struct CsvColumn {
  std::string name;
  std::string unit;         ///< between the brackets or parentheses of the header; empty where there are none
  Eigen::VectorXd value;    ///< in the file's unit; NaN where the cell holds no number
  std::size_t missing = 0;  ///< empty and nan cells
  std::string text;         ///< the first cell that holds neither a finite number nor nothing; empty where there is none
  int text_line = 0;
};

/// A header row `name [unit],...` and rows of numbers below it.
struct CsvTable {
  std::string file;
  int header_line = 0;
  std::vector<CsvColumn> columns;

  Eigen::Index rows() const { return columns.front().value.size(); }
  /// Rows follow the header without a gap, so that no line needs to be stored.
  InputError::Place place(Eigen::Index row) const { return {file, header_line + 1 + static_cast<int>(row)}; }
};

/// Reads header and rows from `text`, which begins at `header_line` of `file`. About 2e7 numbers per second.
///
/// Line ends of LF, CR LF, or CR alone, spaces and quotes around cells, a missing last line end and blank lines at the end are accepted. A cell
/// that is empty or "nan" is missing. Throws InputError, with the line, for a header that is absent, has an unnamed or repeated column or another separator, for rows
/// with too few or too many cells, a header that is no UTF-8, and a file that ends in the middle of a row.
CsvTable read_csv(std::string_view text, int header_line, const std::string& file);

}  // namespace unrig
