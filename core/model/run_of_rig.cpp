// What of a run enters the model of its rig, and what it must have for that.
#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "core/model/aeroelastic_model.h"
#include "core/numerics/median.h"
#include "core/run/column_names.h"
#include "core/files/error.h"
#include "core/files/units.h"

namespace unrig {
namespace {

using Eigen::VectorXd;

/// "; there is a column "Alpha"", where one may have been meant for the column that is missing.
std::string meant_for(const Run& run, const std::string& column) {
  std::vector<std::string> present;
  for (const Channel& channel : run.channels) present.push_back(channel.name);
  for (const std::string& name : present)
    if (meant_column(name, present) == column) return fmt::format("; there is a column \"{}\"", name);
  return "";
}

/// A run must have what its kind says drives the rig, and the rig must be able to answer to it.
void check_kind(const Run& run, const Rig& rig) {
  const auto refuse = [&](const std::string& found, const std::string& wanted) { throw InputError({run.file, run.header_line}, found, wanted, ""); };
  if (run.kind == RunKind::step && rig.is_modal())
    refuse("the run is a step of the angle", "wanted a pluck, a forced or a moved run: the rig " + rig.file + " is known only as modes, and has no section");
  if (run.kind == RunKind::step && !run.find("alpha")) refuse("a step without a column \"alpha\"" + meant_for(run, "alpha"), "wanted the measured angle");
  if (run.kind == RunKind::forced && !run.find("force")) refuse("a forced run without a column \"force\"" + meant_for(run, "force"), "wanted the measured force");
  if (run.kind == RunKind::moved && !run.find("mount_velocity") && !run.find("mount_acceleration"))
    refuse("a moved run without a column \"mount_velocity\" or \"mount_acceleration\"" + meant_for(run, "mount_velocity") + meant_for(run, "mount_acceleration"), "wanted the measured motion of the mount");
}

/// The gauge must read what the rig's gauge reads. Volts and counts will do for a free decay, whose amplitude is free.
void check_gauge_unit(const Run& run, const Rig& rig) {
  const Channel& gauge = run.channel("gauge");
  const std::string wanted = rig.gauge_unit();
  const bool raw = gauge.unit == "V" || gauge.unit == "1";
  if (gauge.unit == wanted || (raw && run.kind == RunKind::pluck)) return;
  throw InputError({run.file, run.header_line}, fmt::format("the column \"gauge\" is in {}", gauge.file_unit),
                   fmt::format("wanted a unit of {}, which the gauge of the rig {} reads", wanted, rig.file),
                   raw ? "Write the calibration into the meta data." : "Give the rig file of this run.");
}

/// So must a sensor's column. Volts and counts will do where its gain is a plain number; a rig made in code may leave the unit open.
void check_sensor_unit(const Run& run, const Sensor& sensor, const Rig& rig) {
  const Channel& column = run.channel(sensor.column);
  const InputError::Place place{run.file, run.header_line};
  const bool raw = column.unit == "V" || column.unit == "1";
  if (raw || sensor.unit.empty() || column.unit == si_unit(sensor.unit, place, sensor.column)) return;
  throw InputError(place, fmt::format("the column \"{}\" is in {}", sensor.column, column.file_unit), fmt::format("wanted a unit of {}, which the sensor of the rig {} reads", sensor.unit, rig.file),
                   column.file_unit == "g" && sensor.unit == "m/s^2" ? "g is the gram; as a multiple of the acceleration of gravity the unit is called gravity." : "Correct the unit, or the sensor's gain in the rig file.");
}

/// Median of the first samples: the angle before the shaft moves.
double first_angle(const VectorXd& alpha) {
  std::vector<double> first;
  constexpr std::size_t enough = 25;
  for (const double x : alpha)
    if (std::isfinite(x) && first.size() < enough) first.push_back(x);
  return median(first);
}

}  // namespace

Conditions conditions_of(const Run& run) {
  Conditions c;
  c.density = run.density;
  c.speed = run.speed;
  c.nyquist = run.dt > 0 ? 0.5 / run.dt : 0;
  c.prescribed_pitch = run.find("alpha") != nullptr && run.kind == RunKind::step;
  c.force = run.find("force") != nullptr;
  c.deviations = run.deviations.get();
  c.mount = run.find("mount_velocity") != nullptr || run.find("mount_acceleration") != nullptr;
  if (const Channel* alpha = run.find("alpha")) c.onset_angle = first_angle(alpha->value);
  return c;
}

std::vector<std::string> AeroelasticModel::output_channels(const Run& run) const {
  check_kind(run, rig_);
  std::vector<std::string> channels;
  const bool has_gauge = rig_.has_gauge();
  if (has_gauge && run.find("gauge")) channels.emplace_back("gauge");
  std::string wanted = channels.empty() && has_gauge ? "a column 'gauge'" : "";
  for (const Sensor& sensor : rig_.sensors) {
    if (run.find(sensor.column)) {
      check_sensor_unit(run, sensor, rig_);
      channels.push_back(sensor.column);
    }
    wanted += (wanted.empty() ? "a column '" : " or '") + sensor.column + "'";
  }
  if (channels.empty())
    throw InputError({run.file, run.header_line}, "none of the columns belongs to this rig (" + rig_.file + ")" + meant_for(run, "gauge"), "wanted " + (wanted.empty() ? "a gauge or a sensor in the rig file" : wanted),
                     "Give the rig file of this run, or add the gauge or [[sensor]] to it.");
  if (channels.front() == "gauge") check_gauge_unit(run, rig_);
  return channels;
}

}  // namespace unrig
