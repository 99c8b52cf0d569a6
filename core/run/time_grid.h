#pragma once
#include <Eigen/Core>
#include <string>
#include <vector>

#include "core/files/csv_table.h"

namespace unrig {

/// The uniform times t_k = start + k step that stand for the stamps of a recording.
struct TimeGrid {
  double start = 0;
  double step = 0;
  double largest_jitter = 0;      ///< largest distance of a stamp from its place on the grid
  bool resample = false;          ///< true where that is more than the rounding of printed stamps
  Eigen::VectorXd stamps;         ///< the stamps, repeated ones spread; empty unless `resample`
  std::vector<int> spread_lines;  ///< lines of the file whose repeated stamps were spread
  std::vector<Eigen::Index> rows;    ///< of the table, that are samples; empty: all of them
  std::vector<int> repeated_lines;   ///< lines of the file that stand for no sample of their own and were left out
};

/// Judges the stamps of `table`'s column `time`; everything is in that column's own unit.
///
/// The grid has as many samples as the file has rows that are samples, from the first stamp to the last.
/// - Stamps within 1e-3 steps of it are on it. So are stamps printed with few digits: within one unit of the last digit of it, with
///   intervals that differ by no more than that, which is no more than half a step; there least squares fit the grid. Nothing is
///   resampled.
/// - Other stamps jitter: the channels are to be interpolated.
/// - A gap is an InputError with its place: an interval of more than 1.5 steps (median or mean, the shorter) that none of the next five
///   stamps makes up. In a recording whose intervals jitter throughout (median deviation from the step above 1e-3 steps and the last
///   printed digit) the limit is 5 steps.
/// - Data loggers stamp a sample late and the next at the same instant. A run of equal stamps is spread evenly over the time since the one
///   before, if that leaves at least half a step each. A sample that is stamped early, at the instant of the one before, is moved likewise.
/// - Where no time is left for it on either side, a row that repeats a stamp is one row too many and is left out: if its readings repeat too,
///   or if stamps are printed so finely, with two digits or more in a step, that two samples cannot share one.
///
/// Every other stamp that does not increase, a missing one, and fewer than three rows are InputErrors.
TimeGrid time_grid(const CsvTable& table, const CsvColumn& time);

/// Linear interpolation of `value`, given at `stamps`, to the grid. A neighbour that is missing makes the sample missing.
Eigen::VectorXd interpolated(const Eigen::VectorXd& value, const TimeGrid& grid);

/// Interpolation of weights: a sample that takes part of its value from one that is left out (weight 0) is left out itself.
Eigen::VectorXd interpolated_weight(const Eigen::VectorXd& weight, const TimeGrid& grid);

}  // namespace unrig
