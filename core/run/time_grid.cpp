#include "core/run/time_grid.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/numerics/median.h"

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

constexpr double rounding_steps = 1e-3;  ///< stamps this near to the grid are on it
constexpr double gap_steps = 1.5;
constexpr double gap_steps_jittering = 5;
constexpr Index make_up_samples = 5;  ///< how soon a late stamp must be made up

VectorXd intervals(const VectorXd& stamps) { return stamps.tail(stamps.size() - 1) - stamps.head(stamps.size() - 1); }

/// One unit of the last digit with which the stamps are printed (0.001 for "12.034"); 0 where none of up to nine digits explains them.
double last_digit(const VectorXd& stamps) {
  double unit = 1;
  for (int digits = 0; digits <= 9; ++digits, unit /= 10) {
    const auto places = stamps.array() / unit;
    const bool printed = ((places - places.round()).abs() < 1e-4).all();
    if (printed) return unit;
  }
  return 0;
}

void check_stamps(const CsvTable& table, const CsvColumn& time) {
  const VectorXd& stamps = time.value;
  for (Index k = 0; k < stamps.size(); ++k) {
    if (!std::isfinite(stamps[k])) throw InputError(table.place(k), "the time is missing", "wanted a number in every row of \"time\"", "");
    if (k > 0 && stamps[k] < stamps[k - 1]) {
      throw InputError(table.place(k), fmt::format("the time falls from {} to {} {}", stamps[k - 1], stamps[k], time.unit),
                       "wanted times that increase", "Write one file per recording.");
    }
  }
}

/// The stamps that are judged, and the rows of the table that they stand in.
struct Stamps {
  const CsvTable& table;
  VectorXd value;
  std::vector<Index> row;  ///< empty: every row
  InputError::Place place(Index k) const { return table.place(row.empty() ? k : row[static_cast<std::size_t>(k)]); }
};

bool same_readings(const CsvTable& table, Index a, Index b) {
  return std::all_of(table.columns.begin(), table.columns.end(), [&](const CsvColumn& column) {
    const double x = column.value[a], y = column.value[b];
    return x == y || (std::isnan(x) && std::isnan(y));
  });
}

/// Runs of equal stamps: spread where there is time for their samples, left out where there is none (core/run/time_grid.h).
class RepeatedStamps {
 public:
  RepeatedStamps(const CsvTable& table, const CsvColumn& time)
      : table_(table), time_(time), stamps_(time.value), extra_(static_cast<std::size_t>(time.value.size()), false) {
    const VectorXd interval = intervals(stamps_);
    // Gaps lengthen the mean, repeated stamps shorten it.
    const double typical = median({interval.begin(), interval.end()});
    step_ = typical > 0 ? std::min(typical, interval.mean()) : 0;
    constexpr double slack = 1.01;  // for the round-off of decimal fractions
    fine_ = typical > 0 && 2 * last_digit(stamps_) <= slack * typical;
  }

  Stamps treated(TimeGrid& grid) {
    for (Index first = 0; first < stamps_.size(); ++first) {
      Index last = first;
      while (last + 1 < stamps_.size() && stamps_[last + 1] == stamps_[first]) ++last;
      if (last > first) treat(first, last, grid);
      first = last;
    }
    if (grid.repeated_lines.empty()) return {table_, std::move(stamps_), {}};
    for (Index k = 0; k < stamps_.size(); ++k)
      if (!extra_[static_cast<std::size_t>(k)]) grid.rows.push_back(k);
    return {table_, stamps_(grid.rows), grid.rows};
  }

 private:
  void treat(Index first, Index last, TimeGrid& grid) {
    const double since = first > 0 ? stamps_[first] - stamps_[first - 1] : 0, until = last + 1 < stamps_.size() ? stamps_[last + 1] - stamps_[last] : 0;
    const double each = since / static_cast<double>(last - first + 1);
    const bool late = since >= gap_steps * step_, early = first > 0 && last == first + 1 && until >= gap_steps * step_;
    if (early && !late) {
      stamps_[last] += until / 2;
      grid.spread_lines.push_back(table_.place(last).line);
    } else if (!late && step_ > 0 && until < gap_steps * step_ && is_extra(first, last)) {
      for (Index k = first + 1; k <= last; ++k) {
        extra_[static_cast<std::size_t>(k)] = true;
        grid.repeated_lines.push_back(table_.place(k).line);
      }
    } else if (step_ > 0 && each >= step_ / 2) {
      for (Index k = first; k < last; ++k) stamps_[k] = stamps_[first] - each * static_cast<double>(last - k);
      grid.spread_lines.push_back(table_.place(first + 1).line);
    } else {
      throw InputError(table_.place(first + 1), fmt::format("the time {} {} stands in two rows", time_.value[first], time_.unit),
                       "wanted times that increase", "Print the times with more digits, or delete the row that stands twice.");
    }
  }

  bool is_extra(Index first, Index last) const {
    for (Index k = first + 1; k <= last; ++k)
      if (!fine_ && !same_readings(table_, first, k)) return false;
    return true;
  }

  const CsvTable& table_;
  const CsvColumn& time_;
  VectorXd stamps_;
  std::vector<bool> extra_;
  double step_ = 0;
  bool fine_ = false;
};

Stamps without_repeated(const CsvTable& table, const CsvColumn& time, TimeGrid& grid) {
  if (std::adjacent_find(time.value.begin(), time.value.end()) == time.value.end()) return {table, time.value, {}};
  return RepeatedStamps(table, time).treated(grid);
}

/// True where the samples after `k` are stamped as early as `k` is stamped late, so that none is missing.
bool is_made_up(const VectorXd& stamps, Index k, double step) {
  for (Index later = 1; later <= make_up_samples && k + later < stamps.size(); ++later) {
    const double expected = step * static_cast<double>(later + 1);
    if (std::abs(stamps[k + later] - stamps[k - 1] - expected) < step / 4) return true;
  }
  return false;
}

/// True where the stamps are those of a uniform grid, printed with few digits: intervals of 1 and 2 ms at 600 Hz. Then every stamp is
/// within one digit of the line from the first to the last, which are rounded too, and intervals differ by one digit. Steps of less than
/// two digits are not judged so: a missing sample looks the same there.
bool are_rounded(const VectorXd& stamps, double digit, double largest_jitter) {
  const VectorXd interval = intervals(stamps);
  const double slack = 1.01;  // for the round-off of decimal fractions
  return digit > 0 && 2 * digit <= slack * median({interval.begin(), interval.end()}) && largest_jitter <= slack * digit &&
         interval.maxCoeff() - interval.minCoeff() <= slack * digit;
}

/// Start and step by least squares: the first and the last stamp are rounded no less than the others.
void fit_line(const VectorXd& stamps, TimeGrid& grid) {
  const double last = static_cast<double>(stamps.size() - 1);
  const VectorXd place = VectorXd::LinSpaced(stamps.size(), -last / 2, last / 2);
  grid.step = place.dot(stamps) / place.squaredNorm();
  grid.start = stamps.mean() - grid.step * last / 2;
}

void refuse_gaps(const Stamps& judged, const CsvColumn& time, double digit) {
  const VectorXd& stamps = judged.value;
  const VectorXd interval = intervals(stamps);
  // Gaps lengthen the mean; coarse printing (1, 2, 2 ms) the median.
  const double step = std::min(median({interval.begin(), interval.end()}), interval.mean());
  const VectorXd off = (interval.array() - step).abs();
  const bool jitters = median({off.begin(), off.end()}) > std::max(rounding_steps * step, digit);
  const double limit = (jitters ? gap_steps_jittering : gap_steps) * step;
  for (Index k = 1; k < stamps.size(); ++k) {
    if (interval[k - 1] <= limit || is_made_up(stamps, k, step)) continue;
    throw InputError(
        judged.place(k),
        fmt::format("the recording has a gap from {} to {} {}, {:.4g} sample steps", stamps[k - 1], stamps[k], time.unit,
                    interval[k - 1] / step),
        fmt::format("wanted a sample about every {:.6g} {}", step, time.unit),
        "Fill the gap with rows whose samples are nan, or split the recording there. If nothing is missing, print the times with "
        "more digits.");
  }
}

/// `blend(left, right, share)` at every time of the grid, from the values on either side and the share of the right one.
template <typename Blend>
VectorXd on_grid(const VectorXd& value, const TimeGrid& grid, Blend blend) {
  const VectorXd& stamps = grid.stamps;
  VectorXd result(value.size());
  Index left = 0;
  for (Index k = 0; k < value.size(); ++k) {
    const double t = std::min(grid.start + grid.step * static_cast<double>(k), stamps[stamps.size() - 1]);
    while (left + 2 < stamps.size() && stamps[left + 1] <= t) ++left;
    const double share = (t - stamps[left]) / (stamps[left + 1] - stamps[left]);
    result[k] = blend(value[left], value[left + 1], share);
  }
  return result;
}

}  // namespace

TimeGrid time_grid(const CsvTable& table, const CsvColumn& time) {
  const auto refuse_few = [&](Index rows) {
    throw InputError({table.file, table.header_line}, fmt::format("{} rows follow the header", rows), "wanted three at least", "");
  };
  if (time.value.size() < 3) refuse_few(time.value.size());
  check_stamps(table, time);
  TimeGrid grid;
  Stamps judged = without_repeated(table, time, grid);
  VectorXd& stamps = judged.value;
  const Index count = stamps.size();
  if (count < 3) refuse_few(count);
  grid.start = stamps[0];
  grid.step = (stamps[count - 1] - stamps[0]) / static_cast<double>(count - 1);
  const VectorXd places = VectorXd::LinSpaced(count, 0, static_cast<double>(count - 1)) * grid.step;
  grid.largest_jitter = (stamps.array() - grid.start - places.array()).abs().maxCoeff();
  if (grid.largest_jitter <= rounding_steps * grid.step) return grid;

  const double digit = last_digit(time.value);
  if (are_rounded(stamps, digit, grid.largest_jitter)) {
    fit_line(stamps, grid);
    return grid;
  }
  refuse_gaps(judged, time, digit);
  grid.resample = true;
  grid.stamps = std::move(stamps);
  return grid;
}

VectorXd interpolated(const VectorXd& value, const TimeGrid& grid) {
  return on_grid(value, grid, [](double left, double right, double share) {
    if (share <= 0) return left;  // so that a missing neighbour does not spoil a sample that stands on the grid
    if (share >= 1) return right;
    return left + share * (right - left);
  });
}

VectorXd interpolated_weight(const VectorXd& weight, const TimeGrid& grid) {
  return on_grid(weight, grid, [](double left, double right, double share) {
    if (share <= 0) return left;
    if (share >= 1) return right;
    return left == 0 || right == 0 ? 0 : left + share * (right - left);
  });
}

}  // namespace unrig
