#pragma once
#include <Eigen/Core>
#include <string>
#include <string_view>
#include <vector>

#include "core/files/csv_table.h"
#include "core/files/provenance.h"

namespace unrig {

/// What a reader of the results must know, in the last columns of their tables: the reduced chi-square in every row, and a column of ones for each warning, which is its name, for what makes the
/// numbers no answer, and for what made them. Every cell stays a number, and the header the first line, as correct/manual/results.md shows it: lines of comment or columns of text would stop the programs that read these tables.
struct HowFarToTrust {
  double reduced_chi2 = 0;  ///< NaN where the result has none
  std::vector<std::string> warnings;
  std::string no_answer;
  MadeBy made_by = {};

  std::string header() const;
  /// The cells of any row.
  std::string cells() const;
  /// Out of a table that `unrig correct` wrote: NaN and nothing where the columns are absent.
  static HowFarToTrust of_table(const CsvTable& table);

  /// Whether more is left of gauge and angle, of so many samples, than their noise (fit/likelihood/explained.h).
  bool misses_something(Eigen::Index samples) const;
};

}  // namespace unrig
