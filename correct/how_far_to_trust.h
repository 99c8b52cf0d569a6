#pragma once
#include <string>
#include <string_view>
#include <vector>

#include "core/csv_table.h"

namespace unrig {

/// What a reader of the results must know, in the last columns of their tables: the reduced chi-square in every row, and the warnings, one a row from the
/// first on, in a column that is there only where there are any. Lines of comment above the header would say it too, but whoever takes the first line for
/// the header, as formats.md shows it, could no longer read the file; and where nothing is to be warned of every cell stays a number.
struct HowFarToTrust {
  double reduced_chi2 = 0;  ///< NaN where the result has none
  std::vector<std::string> warnings;

  std::string header() const;
  /// The cells of row `k`. Commas and quotes within a warning become semicolons and apostrophes, so that every reader finds its cells.
  std::string cells(std::size_t k) const;
  /// Out of a table that `unrig correct` wrote, and its text: NaN and nothing where the columns are absent.
  static HowFarToTrust of_table(const CsvTable& table, std::string_view text);

  /// Gauge and angle are explained no better than this where something is missing from the model.
  static constexpr double explained = 1.5;
  /// Stands in a warning after which the answer is not one.
  static constexpr const char* wrong = "Load and response are wrong";
  bool is_wrong() const;
};

}  // namespace unrig
