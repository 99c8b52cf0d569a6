#include "core/run/run_limits.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "core/files/csv_table.h"
#include "core/files/toml_table.h"
#include "core/files/units.h"

namespace unrig {
namespace {

using Eigen::Index;

/// The smallest and the largest of the values that count; low > high where none does.
struct Range {
  double low = std::numeric_limits<double>::infinity(), high = -std::numeric_limits<double>::infinity();
  void add(double x) {
    if (std::isfinite(x)) low = std::min(low, x), high = std::max(high, x);
  }
  bool varies() const { return low < high; }
};

Range range_of(const Run& run, const Channel& channel) {
  const Channel* weight = run.find("weight");
  Range range;
  for (Index k = 0; k < channel.value.size(); ++k)
    if (!weight || weight->value[k] > 0) range.add(channel.value[k]);
  return range;
}

}  // namespace

void check_conditions(const TomlTable& meta, const Run& run) {
  constexpr double densest = 22'590, light = 299'792'458;
  if (!(run.density <= densest))
    meta.fail("density", fmt::format("density is {:g} kg/m^3", run.density), fmt::format("wanted at most {:g}, that of osmium, the densest element", densest));
  if (!(run.speed <= light)) meta.fail("speed", fmt::format("speed is {:g} m/s", run.speed), fmt::format("wanted at most {:g}, the speed of light", light));
}

void check_times(const CsvTable& table, const CsvColumn& time, const UnitScale& seconds) {
  constexpr double longest = 4.4e17;
  for (Index k = 0; k < time.value.size(); ++k)
    if (std::abs(seconds(time.value[k])) > longest)
      throw InputError(table.place(k), fmt::format("the time is {:g} {}", time.value[k], time.unit), fmt::format("wanted a time within {:g} s, the age of the universe", longest), "");
}

void check_step(const CsvTable& table, double dt) {
  constexpr double shortest = 1e-12, year = 3.2e7;
  if (dt >= shortest && dt <= year) return;
  throw InputError({table.file, table.header_line}, fmt::format("the samples are {:g} s apart", dt), fmt::format("wanted {:g} s at least, as no instrument is faster, and a year at most", shortest),
                   "Look at the unit of the column \"time\".");
}

void check_readings(const CsvTable& table, const CsvColumn& column, const UnitScale& scale, const std::string& unit) {
  constexpr double largest = std::numeric_limits<float>::max(), smallest = std::numeric_limits<float>::min();
  const char* const advice = "Look at the column's unit and calibration; a sample that is missing is nan.";
  Range range;
  for (Index k = 0; k < column.value.size(); ++k) {
    const double x = scale(column.value[k]);
    if (!(std::abs(x) <= largest) && !std::isnan(column.value[k]))
      throw InputError(table.place(k), fmt::format("the column \"{}\" reads {:g} {}", column.name, column.value[k], column.unit),
                       fmt::format("wanted a reading of an instrument, within {:.2g} {}", largest, unit), advice);
    range.add(x);
  }
  if (range.varies() && range.high - range.low < smallest)
    throw InputError({table.file, table.header_line}, fmt::format("the column \"{}\" varies by {:g} {} only", column.name, range.high - range.low, unit),
                     fmt::format("wanted readings of an instrument, {:.2g} at least", smallest), advice);
}

void check_what_drives(const Run& run) {
  std::vector<const Channel*> driving;
  const auto add = [&](const char* name) {
    if (const Channel* channel = run.find(name)) driving.push_back(channel);
  };
  if (run.kind == RunKind::step) add("alpha");
  if (run.kind == RunKind::forced) add("force");
  if (run.kind == RunKind::moved) add("mount_velocity"), add("mount_acceleration");
  if (driving.empty()) return;  // core/model/run_of_rig.cpp says so
  const auto varies = [&](const Channel* channel) { return range_of(run, *channel).varies(); };
  if (std::any_of(driving.begin(), driving.end(), varies)) return;
  const Channel& still = *driving.front();
  const double value = range_of(run, still).low / still.factor;
  throw InputError({run.file, run.header_line},
                   std::isfinite(value) ? fmt::format("the column \"{}\" never changes, it is {:g} {} throughout", still.name, value, still.file_unit)
                                        : fmt::format("the column \"{}\" has no number in a row that counts", still.name),
                   fmt::format("wanted what drives a run of the kind \"{}\"", to_string(run.kind)),
                   run.kind == RunKind::step ? "Look for a dead encoder or a stopped converter; a free decay at a constant angle is of the kind \"pluck\"." : "Look for a broken cable or a stopped converter.");
}

void check_reading_changes(const Run& run, const std::string& column) {
  if (range_of(run, run.channel(column)).varies()) return;
  throw InputError({run.file, run.header_line}, fmt::format("the column \"{}\" never changes", column), "wanted a reading that answers to the rig", "Look for a broken cable or a stopped converter.");
}

}  // namespace unrig
