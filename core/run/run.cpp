#include "core/run/run.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <limits>
#include <map>
#include <optional>
#include <utility>

#include "core/run/bad_readings.h"
#include "core/run/column_names.h"
#include "core/files/csv_table.h"
#include "core/run/release.h"
#include "core/run/run_limits.h"
#include "core/rig/stated_errors.h"
#include "core/files/text_file.h"
#include "core/files/text_kind.h"
#include "core/run/time_grid.h"
#include "core/files/toml_table.h"
#include "core/files/units.h"

namespace unrig {

using Eigen::VectorXd;

namespace {

constexpr std::array kinds = {std::pair{RunKind::step, "step"}, std::pair{RunKind::pluck, "pluck"}, std::pair{RunKind::forced, "forced"},
                              std::pair{RunKind::moved, "moved"}};

/// A column that the program gives a meaning, and the SI unit it must have; empty where the file chooses.
struct KnownColumn {
  const char* name;
  const char* si;
};
constexpr std::array known_columns = {KnownColumn{"time", "s"},
                                      KnownColumn{"alpha", "rad"},
                                      KnownColumn{"gauge", ""},
                                      KnownColumn{"force", ""},
                                      KnownColumn{"weight", "1"},
                                      KnownColumn{"mount_velocity", "m/s"},
                                      KnownColumn{"mount_acceleration", "m/s^2"}};

const KnownColumn* known(std::string_view name) {
  const auto found = std::find_if(known_columns.begin(), known_columns.end(), [name](const KnownColumn& one) { return name == one.name; });
  return found == known_columns.end() ? nullptr : &*found;
}

// ---------------------------------------------------------------------------------------------------------------- meta data

/// The leading comment lines as TOML, line by line as in the file, and the table below them.
struct Split {
  std::string meta_data;
  int lines = 0;
  std::string_view table;
};

Split split(std::string_view text) {
  if (text.starts_with("\xEF\xBB\xBF")) text.remove_prefix(3);
  Split parts;
  while (!text.empty()) {
    const std::size_t end = text.find('\n');
    std::string_view line = text.substr(0, end);
    const bool blank = line.find_first_not_of(" \t\r") == std::string_view::npos;
    if (!blank && line.front() != '#') break;
    if (!blank) line.remove_prefix(line.starts_with("# ") ? 2 : 1);
    if (line.ends_with('\r')) line.remove_suffix(1);
    parts.meta_data.append(line).push_back('\n');
    ++parts.lines;
    text.remove_prefix(end == std::string_view::npos ? text.size() : end + 1);
  }
  parts.table = text;
  return parts;
}

/// The meta data that scale a column in volts or counts.
struct Calibration {
  std::string key;
  InputError::Place place;
  std::optional<Measure> measure;
};

Calibration read_calibration(const TomlTable& meta, const std::string& key) {
  Calibration calibration{key, meta.place(key), {}};
  if (!meta.has(key)) return calibration;
  calibration.measure = split_quantity(meta.text(key), calibration.place, key);
  if (calibration.measure->value == 0) meta.fail(key, fmt::format("{} is 0", key), "wanted a value that is not zero");
  return calibration;
}

void check_run_version(const TomlTable& meta, const std::string& path) {
  if (!meta.has("unrig_run")) {
    throw InputError({path, 1}, "the file does not say that it is a run file", "wanted the line `# unrig_run = 1` at its head",
                     "Meta data are TOML in leading lines that begin with `# `.");
  }
  if (meta.integer("unrig_run") != 1) {
    meta.fail("unrig_run", fmt::format("unrig_run is {}", meta.integer("unrig_run")), "wanted 1, the only version of the format there is");
  }
}

RunKind read_kind(const TomlTable& meta) {
  const std::string text = meta.text("kind");
  for (const auto& [kind, name] : kinds) {
    if (text == name) return kind;
  }
  meta.fail("kind", fmt::format("kind is \"{}\"", text), "wanted \"step\", \"pluck\", \"forced\" or \"moved\"");
}

double not_negative(const TomlTable& meta, std::string_view key, std::string_view si) {
  const double value = meta.quantity(key, si);
  if (value < 0) meta.fail(key, fmt::format("{} is {} {}", key, value, si), "wanted zero or more");
  return value;
}

Run read_meta_data(const TomlTable& meta, const std::string& path) {
  check_run_version(meta, path);
  meta.allow_only({"unrig_run", "name", "kind", "medium", "density", "speed", "calibration", "force_calibration", "density_std", "density_std_percent", "density_error", "speed_std",
                   "speed_std_percent", "speed_error", "calibration_std", "calibration_std_percent", "calibration_error", "force_calibration_std", "force_calibration_std_percent",
                   "force_calibration_error", "clock_std_percent", "clock_error"});
  Run run;
  run.file = path;
  run.name = meta.text_or("name", std::filesystem::path(path).stem().string());
  run.kind = read_kind(meta);
  run.medium = meta.text_or("medium", "");
  run.density = not_negative(meta, "density", "kg/m^3");
  run.speed = not_negative(meta, "speed", "m/s");
  check_conditions(meta, run);
  run.givens = stated_errors_of_run(meta, run);
  return run;
}

// ---------------------------------------------------------------------------------------------------------------- columns

void check_columns(const CsvTable& table) {
  const InputError::Place header{table.file, table.header_line};
  const auto is_time = [](const CsvColumn& column) { return column.name == "time"; };
  if (std::none_of(table.columns.begin(), table.columns.end(), is_time)) {
    throw InputError(header, "the header has no column \"time\"", "wanted a header such as `time [s],alpha [deg],gauge [N]`", "");
  }
  if (table.columns.size() == 1) throw InputError(header, "\"time\" is the only column", "wanted a measured column beside it", "");
  for (const CsvColumn& column : table.columns) {
    if (column.unit.empty() && column.name != "weight") {
      throw InputError(header, fmt::format("the column \"{}\" has no unit", column.name), fmt::format("wanted `{} [unit]`", column.name),
                       "The unit of a number without dimension is [1].");
    }
    if (!known(column.name)) continue;
    if (!column.text.empty()) {
      throw InputError({table.file, column.text_line}, fmt::format("the column \"{}\" holds \"{}\"", column.name, column.text),
                       "wanted a finite number, nan or an empty cell", "");
    }
    if (table.rows() > 0 && column.missing == static_cast<std::size_t>(table.rows())) {
      throw InputError(header, fmt::format("the column \"{}\" has no number in any of {} rows", column.name, table.rows()),
                       "wanted measured values", "Delete the column if it was not measured.");
    }
  }
}

void check_weight(const CsvTable& table, const CsvColumn& weight) {
  for (Eigen::Index k = 0; k < weight.value.size(); ++k) {
    if (weight.value[k] >= 0) continue;
    const bool negative = weight.value[k] < 0;
    throw InputError(table.place(k), negative ? fmt::format("the weight is {}", weight.value[k]) : "the weight is missing",
                     "wanted zero or more in every row", "A weight of 0 leaves the sample out.");
  }
  if ((weight.value.array() == 0).all()) {
    throw InputError({table.file, table.header_line}, "every weight is zero", "wanted samples that are not left out", "");
  }
}

/// The scale of a column and the SI unit it leads to.
struct ColumnScale {
  UnitScale scale;
  std::string unit;
};

/// Readings that a bridge or a force transducer can be calibrated to. What is not among them is a calibration in the wrong unit, such as
/// "4.4 N" for a column in volts, which would make N V of it.
bool is_reading(const std::string& si) {
  constexpr std::array readings = {"N", "N.m", "rad", "m", "m/s", "m/s^2", "rad/s", "rad/s^2", "Pa", "1"};
  return std::find(readings.begin(), readings.end(), si) != readings.end();
}

/// Volts or counts to what was calibrated: 4.4 N/V times a column in mV is 0.0044 N per unit of the column.
ColumnScale calibrated(const CsvColumn& column, const std::string& raw, const Calibration& calibration) {
  const InputError::Place& place = calibration.place;
  if (raw != "V" && raw != "1") {
    throw InputError(place, fmt::format("{} is given, while the column \"{}\" is in {} already", calibration.key, column.name, column.unit),
                     "wanted it only for a column in volts or counts", "Delete the key, or give the column the unit it was recorded in.");
  }
  const std::string product = fmt::format("({}).({})", calibration.measure->unit, column.unit);
  si_unit(calibration.measure->unit, place, calibration.key);  // so that an unknown unit is reported as it stands in the file
  const std::string si = si_unit(product, place, calibration.key);
  if (!is_reading(si) && !(raw == "1" && si == "V")) {
    throw InputError(place,
                     fmt::format("{} has the unit \"{}\", for the column \"{}\" in {}", calibration.key, calibration.measure->unit,
                                 column.name, column.unit),
                     raw == "V" ? "wanted a reading per volt, such as \"4.4 N/V\"" : "wanted a reading per count, such as \"0.01 N\"", "");
  }
  const double factor = calibration.measure->value * unit_scale(product, si, place, calibration.key).factor;
  return {{factor, 0}, si};
}

ColumnScale measured_scale(const CsvColumn& column, const Calibration& calibration, const InputError::Place& place, Run& run) {
  const std::string what = fmt::format("the column \"{}\"", column.name);
  const std::string raw = si_unit(column.unit, place, what);
  if (calibration.measure) return calibrated(column, raw, calibration);
  if (raw == "V" || raw == "1") {
    run.warnings.push_back(fmt::format("{}: {} stays in {}: the file gives no {}", run.file, what, column.unit, calibration.key));
  }
  return {unit_scale(column.unit, raw, place, what), raw};
}

/// SI where UDUNITS knows the unit; else as it is.
ColumnScale unknown_scale(const CsvColumn& column, const InputError::Place& place) {
  try {
    const std::string si = si_unit(column.unit, place, column.name);
    return {unit_scale(column.unit, si, place, column.name), si};
  } catch (const InputError&) {
    return {{}, column.unit};
  }
}

struct Calibrations {
  Calibration gauge;
  Calibration force;
};

ColumnScale scale_of(const CsvColumn& column, const CsvTable& table, const Calibrations& calibrations, Run& run) {
  const InputError::Place header{table.file, table.header_line};
  if (column.name == "gauge") return measured_scale(column, calibrations.gauge, header, run);
  if (column.name == "force") return measured_scale(column, calibrations.force, header, run);
  if (column.name == "weight" && column.unit.empty()) return {{}, "1"};
  if (const KnownColumn* meaning = known(column.name)) {
    return {unit_scale(column.unit, meaning->si, header, fmt::format("the column \"{}\"", column.name)), meaning->si};
  }
  return unknown_scale(column, header);
}

void warn_of_idle_calibration(const Calibration& calibration, const std::string& column, Run& run) {
  if (calibration.measure && !run.find(column)) {
    run.warnings.push_back(
        fmt::format("{}:{}: {} is not used: there is no column \"{}\"", run.file, calibration.place.line, calibration.key, column));
  }
}

/// Lays the grid's times under the run, in seconds.
void take_times(const TimeGrid& grid, const UnitScale& seconds, Run& run) {
  run.start = seconds(grid.start);
  run.dt = seconds.factor * grid.step;
  run.largest_jitter = seconds.factor * grid.largest_jitter;
  run.resampled = grid.resample;
  if (!grid.spread_lines.empty()) {
    run.warnings.push_back(fmt::format("{}:{}: {} time stamp(s) repeat the one before; they are spread over the long interval beside them",
                                       run.file, grid.spread_lines.front(), grid.spread_lines.size()));
  }
  if (!grid.repeated_lines.empty()) {
    run.warnings.push_back(fmt::format("{}:{}: {} row(s) repeat the time of the row before, with no sample missing beside them, and are left out",
                                       run.file, grid.repeated_lines.front(), grid.repeated_lines.size()));
  }
  if (grid.resample) {
    run.warnings.push_back(
        fmt::format("{}: times jitter by up to {:.3g} s ({:.3g} sample steps); every column is interpolated to a uniform step of {:.6g} s",
                    run.file, run.largest_jitter, run.largest_jitter / run.dt, run.dt));
  }
}

// ---------------------------------------------------------------------------------------------------------------- bad readings

/// How many readings of a column are left out.
struct LeftOut {
  std::size_t isolated = 0, clipped = 0;
};

bool is_input(std::string_view name) { return name == "force" || name.starts_with("mount_"); }

void leave_out(CsvColumn& column, const std::vector<Eigen::Index>& samples) {
  for (const Eigen::Index k : samples) column.value[k] = std::numeric_limits<double>::quiet_NaN();
}

/// What is said of bad readings: which column, how many of them, when the first.
class BadReadings {
 public:
  BadReadings(CsvTable& table, const VectorXd& seconds, const std::vector<Eigen::Index>& samples, Run& run) : table_(table), seconds_(seconds), samples_(samples), run_(run) {}

  /// By the column's place in the table.
  std::vector<LeftOut> leave_out_all() {
    std::vector<LeftOut> counts(table_.columns.size());
    std::vector<Eigen::Index> blows;
    for (const bool inputs : {true, false})  // what answers to a blow is judged knowing it
      for (std::size_t c = 0; c < counts.size(); ++c) {
        CsvColumn& column = table_.columns[c];
        if (column.name == "time" || column.name == "weight" || !column.text.empty() || is_input(column.name) != inputs) continue;
        leave_out_no_readings(column);
        if (column.name == "alpha") continue;  // its spikes are found where it is known when the shaft moves (core/run/motion.h)
        counts[c] = judge(column, inputs, blows);
      }
    return counts;
  }

 private:
  void leave_out_no_readings(CsvColumn& column) {
    std::vector<Eigen::Index> none;
    for (Eigen::Index k = 0; k < column.value.size(); ++k)
      if (std::abs(column.value[k]) >= no_reading) none.push_back(k);
    if (none.empty()) return;
    leave_out(column, none);
    column.missing += none.size();
    if (known(column.name) && column.missing == static_cast<std::size_t>(table_.rows()))
      throw InputError(table_.place(none.front()), fmt::format("the column \"{}\" holds nothing but numbers of {:g} and more, which no reading has", column.name, no_reading), "wanted measured values", "");
    tell(column, none, fmt::format("number(s) beyond {:g}, which instruments send where they have no reading", no_reading), "They count as missing.");
  }

  /// The readings that are samples: a row too many is judged by its time alone.
  VectorXd samples_of(const CsvColumn& column) const { return samples_.empty() ? column.value : VectorXd(column.value(samples_)); }
  std::vector<Eigen::Index> rows_of(std::vector<Eigen::Index> samples) const {
    if (!samples_.empty())
      for (Eigen::Index& k : samples) k = samples_[static_cast<std::size_t>(k)];
    return samples;
  }

  LeftOut judge(CsvColumn& column, bool input, std::vector<Eigen::Index>& blows) {
    SuspectReadings suspect = isolated_readings(samples_of(column), input ? ReadingOf::input : ReadingOf::answer, blows);
    suspect.isolated = rows_of(std::move(suspect.isolated));
    if (!suspect.isolated.empty()) tell(column, suspect.isolated, "isolated reading(s) far from their neighbours", "They are left out.");
    leave_out(column, suspect.isolated);
    blows.insert(blows.end(), suspect.blows.begin(), suspect.blows.end());
    const std::vector<Eigen::Index> clipped = rows_of(clipped_readings(samples_of(column)));
    if (clipped.empty()) return {suspect.isolated.size(), 0};
    const std::string what = fmt::format("reading(s) at the end of its range, {:g} {}, which cuts the signal off", column.value[clipped.front()], column.unit);
    if (input) {
      tell(column, clipped, what, "What drove the rig there is not known, and the answer is off by it. Lower the gain of the amplifier, and record again.");
      return {suspect.isolated.size(), 0};
    }
    tell(column, clipped, what, "They are left out, and errors are wider for it. Lower the gain of the amplifier.");
    leave_out(column, clipped);
    return {suspect.isolated.size(), clipped.size()};
  }

  void tell(const CsvColumn& column, const std::vector<Eigen::Index>& samples, const std::string& what, const std::string& so) {
    run_.warnings.push_back(fmt::format("{}:{}: the column \"{}\" holds {} {} (the first at {:.6g} s). {}", run_.file, table_.place(samples.front()).line, column.name, samples.size(), what,
                                        seconds_[samples.front()], so));
  }

  CsvTable& table_;
  const VectorXd& seconds_;
  const std::vector<Eigen::Index>& samples_;  // rows that are samples; empty: all of them
  Run& run_;
};

Channel make_channel(CsvColumn& column, const ColumnScale& to, const TimeGrid& grid, const LeftOut& left_out) {
  Channel channel{column.name, column.unit, to.unit, to.scale.factor, std::move(column.value), column.missing, left_out.clipped, left_out.isolated};
  if (!grid.rows.empty()) channel.value = Eigen::VectorXd(channel.value(grid.rows));
  if (grid.resample) channel.value = column.name == "weight" ? interpolated_weight(channel.value, grid) : interpolated(channel.value, grid);
  channel.value = (channel.value.array() * to.scale.factor + to.scale.offset).matrix();
  return channel;
}

void take_columns(CsvTable& table, const Calibrations& calibrations, Run& run) {
  check_columns(table);
  const auto time = std::find_if(table.columns.begin(), table.columns.end(), [](const CsvColumn& column) { return column.name == "time"; });
  const UnitScale seconds = scale_of(*time, table, calibrations, run).scale;
  check_times(table, *time, seconds);
  const TimeGrid grid = time_grid(table, *time);
  take_times(grid, seconds, run);
  check_step(table, run.dt);
  std::map<std::string, ColumnScale> scales;  // of columns without a meaning, by their unit: there may be 100 000 of them
  const VectorXd stamps = (time->value.array() * seconds.factor + seconds.offset).matrix();
  const std::vector<LeftOut> left_out = BadReadings(table, stamps, grid.rows, run).leave_out_all();
  for (CsvColumn& column : table.columns) {
    if (column.name == "time") continue;
    if (!column.text.empty()) {
      run.warnings.push_back(
          fmt::format("{}:{}: the column \"{}\" holds \"{}\" and is left out", run.file, column.text_line, column.name, column.text));
      continue;
    }
    if (column.name == "weight") check_weight(table, column);
    const auto known_scale = scales.find(column.unit);
    const ColumnScale scale = known_scale != scales.end() && !known(column.name) ? known_scale->second : scale_of(column, table, calibrations, run);
    if (!known(column.name)) scales.emplace(column.unit, scale);
    try {
      check_readings(table, column, scale.scale, scale.unit);
    } catch (const InputError& error) {
      if (known(column.name)) throw;
      run.warnings.push_back(fmt::format("{} It is left out.", error.what()));
      continue;
    }
    run.channels.push_back(make_channel(column, scale, grid, left_out[static_cast<std::size_t>(&column - table.columns.data())]));
  }
  if (run.channels.empty()) {
    throw InputError({table.file, table.header_line}, "no column but \"time\" holds numbers", "wanted a measured column", "");
  }
}

}  // namespace

std::string to_string(RunKind kind) {
  return std::find_if(kinds.begin(), kinds.end(), [kind](const auto& one) { return one.first == kind; })->second;
}

std::vector<std::string_view> columns_with_a_meaning() {
  std::vector<std::string_view> names;
  for (const KnownColumn& one : known_columns) names.emplace_back(one.name);
  return names;
}

const Channel* Run::find(std::string_view column) const {
  const auto found = std::find_if(channels.begin(), channels.end(), [column](const Channel& channel) { return channel.name == column; });
  return found == channels.end() ? nullptr : &*found;
}

const Channel& Run::channel(std::string_view column) const {
  if (const Channel* found = find(column)) return *found;
  std::vector<std::string> names;
  for (const Channel& one : channels) names.push_back(one.name);
  std::string meant;
  for (const std::string& one : names)
    if (meant_column(one, names) == column) meant = fmt::format("; there is a column \"{}\"", one);
  throw InputError({file, 0}, fmt::format("the run has no column \"{}\" of numbers, but: {}{}", column, fmt::join(names, ", "), meant),
                   fmt::format("wanted a column \"{}\"", column), "");
}

Run read_run(const std::string& path) { return parse_run(read_text(path), path); }

Run parse_run(std::string_view text, const std::string& path) {
  refuse_other_kinds(text, path, TextKind::run);
  std::string converted;
  if (ends_lines_with_returns(text)) text = converted = with_line_feeds(text);
  const Split parts = split(text);
  const TomlTable meta =
      TomlTable::parse(parts.meta_data, path, "Text stands in double quotes; a remark among the meta data begins with `# #`.");
  Run run = read_meta_data(meta, path);
  const Calibrations calibrations{read_calibration(meta, "calibration"), read_calibration(meta, "force_calibration")};

  if (parts.table.empty()) {
    throw InputError({path, parts.lines}, "the file ends after its meta data", "wanted a header row `name [unit],...` and numbers", "");
  }
  run.header_line = parts.lines + 1;
  CsvTable table = read_csv(parts.table, run.header_line, path);
  take_columns(table, calibrations, run);
  warn_of_idle_calibration(calibrations.gauge, "gauge", run);
  warn_of_idle_calibration(calibrations.force, "force", run);
  begin_at_release(run);
  return run;
}

}  // namespace unrig
