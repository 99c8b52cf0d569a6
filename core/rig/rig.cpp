#include "core/rig/rig.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <tuple>
#include <utility>

#include "core/rig/parse_rig.h"
#include "core/rig/rig_chain.h"
#include "core/rig/rig_gauge.h"
#include "core/rig/stated_errors.h"
#include "core/files/text_file.h"
#include "core/files/text_kind.h"
#include "core/files/toml_table.h"
#include "core/files/units.h"

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

constexpr std::array sensor_kinds = {std::pair{"displacement", SensorKind::displacement}, std::pair{"velocity", SensorKind::velocity},
                                     std::pair{"acceleration", SensorKind::acceleration}, std::pair{"twist", SensorKind::twist},
                                     std::pair{"twist_rate", SensorKind::twist_rate}, std::pair{"load", SensorKind::load}};

void check_rig_version(const TomlTable& file, const std::string& path) {
  if (!file.has("unrig_rig")) {
    throw InputError({path, 1}, "the file does not say that it is a rig file", "wanted the line `unrig_rig = 1` at its head", "");
  }
  if (file.integer("unrig_rig") != 1) {
    file.fail("unrig_rig", fmt::format("unrig_rig is {}", file.integer("unrig_rig")), "wanted 1, the only version of the format there is");
  }
}

/// Refuses an element that a chain does not have.
void check_element(const TomlTable& table, std::string_view key, int number, Index elements) {
  if (number < 1 || number > elements) {
    table.fail(key, fmt::format("{} is {}", table.full_name(key), number), fmt::format("wanted an element from 1 to {}", elements));
  }
}

int element_number(const TomlTable& table, std::string_view key, Index elements) {
  const int number = table.integer(key);
  check_element(table, key, number, elements);
  return number;
}

// ------------------------------------------------------------------------------------------------------ structure

void take_section(const TomlTable& section, Rig& rig) {
  section.allow_only({"chord", "pitch_axis", "chord_std", "chord_std_percent", "pitch_axis_std", "pitch_axis_std_percent"});
  rig.chord = section.positive_quantity("chord", "m");
  rig.pitch_axis = section.number("pitch_axis");
  if (rig.pitch_axis < 0 || rig.pitch_axis > 1) {
    section.fail("pitch_axis", fmt::format("section.pitch_axis is {}", rig.pitch_axis),
                 "wanted a fraction of the chord from 0, the leading edge, to 1, the trailing edge");
  }
}

void take_submerged(const TomlTable& submerged, const NormalLayout& layout, Rig& rig) {
  submerged.allow_only({"elements", "strip_length", "strip_length_std", "strip_length_std_percent"});
  rig.submerged = submerged.integers("elements");
  int before = 0;
  for (const int element : rig.submerged) {
    if (element <= before || element > rig.station.size()) {
      submerged.fail("elements", fmt::format("submerged.elements holds {} after {}", element, before),
                     fmt::format("wanted increasing elements from 1 to {}", rig.station.size()));
    }
    before = element;
  }
  if (submerged.has("strip_length") || layout.length.size() == 0 || rig.submerged.empty()) {
    rig.strip_length = submerged.positive_quantity("strip_length", "m");
    return;
  }
  rig.strip_length = layout.length[rig.submerged.front() - 1];
  for (const int element : rig.submerged) {
    const double length = layout.length[element - 1];
    if (std::abs(length - rig.strip_length) > 1e-9 * length)
      submerged.fail("strip_length", fmt::format("the submerged elements are {:.6g} and {:.6g} m long, and submerged.strip_length is not given", rig.strip_length, length), "wanted one length of all strips");
  }
}

/// Masses on the pitch axis: what is taken where nobody measured it.
VectorXd read_mass_centres(const TomlTable& normal, Index elements, Assumed& assumed) {
  if (normal.has("mass_centre")) return normal.quantities("mass_centre", "m", elements);
  assumed.emplace_back("normal.mass_centre = 0 (on the pitch axis)");
  return VectorXd::Zero(elements);
}

/// The submerged section is stiff against the rest, and its inboard end turns all of it.
int read_rigid_from(const TomlTable& torsion, const Rig& rig, Assumed& assumed) {
  if (torsion.has("rigid_from") || rig.submerged.empty()) return element_number(torsion, "rigid_from", rig.station.size());
  assumed.push_back(fmt::format("torsion.rigid_from = {} (the first submerged element)", rig.submerged.front()));
  return rig.submerged.front();
}

/// Moments of inertia about the pitch axis that follow from sections know nothing of `mass_centre`; no body has less than its mass times the square of its distance.
void check_inertia_holds(const TomlTable& torsion, const Rig& rig) {
  const VectorXd least = rig.normal.inertia.cwiseProduct(rig.mass_centre.cwiseAbs2());
  for (Index k = 0; k < rig.torsion.inertia.size(); ++k) {
    const Index carried = k + 1 == rig.rigid_from ? least.size() - k : 1;
    const double needed = least.segment(k, carried).sum();
    if (rig.torsion.inertia[k] < needed)
      torsion.fail("added_inertia", fmt::format("the sections and torsion.added_inertia give element {} an inertia of {:.4g} kg m^2 about the pitch axis", k + 1, rig.torsion.inertia[k]),
                   fmt::format("wanted at least {:.4g} kg m^2, that of its masses at their normal.mass_centre", needed), "Give torsion.added_inertia, inertia_per_length of a section, or torsion.inertia.");
  }
}

/// One note for all that a rig file leaves to the program.
void say_what_is_assumed(const Assumed& assumed, Rig& rig) {
  if (!assumed.empty()) rig.warnings.push_back(fmt::format("{}: not given, and taken as: {}", rig.file, fmt::join(assumed, "; ")));
}

void take_chains(const TomlTable& file, Rig& rig) {
  const TomlTable normal = file.table("normal");
  const TomlTable torsion = file.table("torsion");
  const NormalLayout layout = read_normal_layout(normal);
  rig.station = layout.station;
  Assumed assumed;
  rig.normal = read_normal_chain(normal, layout, rig.warnings, assumed);
  rig.mass_centre = read_mass_centres(normal, rig.station.size(), assumed);
  take_submerged(file.table("submerged"), layout, rig);
  rig.rigid_from = read_rigid_from(torsion, rig, assumed);
  rig.torsion = read_torsion_chain(torsion, normal, layout, rig.rigid_from, rig.warnings, assumed);
  check_element(torsion, "rigid_from", rig.rigid_from, rig.torsion.inertia.size());
  if (!torsion.has("inertia")) check_inertia_holds(torsion, rig);
  say_what_is_assumed(assumed, rig);
}

void take_gauge(const TomlTable& gauge, Rig& rig) {
  gauge.allow_only({"element", "calibration_element", "calibration_uncertainty", "lowpass", "response", "delay"});
  rig.gauge_element = element_number(gauge, "element", rig.station.size());
  rig.calibration_element = element_number(gauge, "calibration_element", rig.station.size());
  if (rig.calibration_element <= rig.gauge_element) {
    gauge.fail("calibration_element",
               fmt::format("the dead weights hung at element {}, the gauge sits at element {}", rig.calibration_element, rig.gauge_element),
               "wanted gauge.calibration_element outboard of gauge.element", "Weights inboard of the bridge do not bend it.");
  }
  take_gauge_channel(gauge, rig);
}

SensorKind sensor_kind(const TomlTable& sensor) {
  const std::string text = sensor.text("reads");
  for (const auto& [name, kind] : sensor_kinds) {
    if (text == name) return kind;
  }
  sensor.fail("reads", fmt::format("{} is \"{}\"", sensor.full_name("reads"), text),
              "wanted \"displacement\", \"velocity\", \"acceleration\", \"twist\", \"twist_rate\" or \"load\"");
}

const char* quantity_unit(SensorKind kind) {
  switch (kind) {
    case SensorKind::displacement: return "m";
    case SensorKind::velocity: return "m/s";
    case SensorKind::acceleration: return "m/s^2";
    case SensorKind::twist: return "rad";
    case SensorKind::twist_rate: return "rad/s";
    case SensorKind::load: break;  // each of its keys has its own
  }
  return "";
}

struct Gain {
  double value;
  std::string unit;  // SI, of the column
};

/// Per `quantity`: a plain number, or number and unit: "0.5 V/m" is the gain of a column in volts.
Gain sensor_gain(const TomlTable& table, const std::string& key, const char* quantity) {
  if (!table.has_text(key)) return {table.number_or(key, 1), quantity};
  const InputError::Place place = table.place(key);
  const std::string name = table.full_name(key);
  const Measure measure = split_quantity(table.text(key), place, name);
  return {unit_scale(measure.unit, si_unit(measure.unit, place, name), place, name)(measure.value), si_unit(fmt::format("({}).({})", measure.unit, quantity), place, name)};
}

void take_sensor_gain(const TomlTable& table, Sensor& sensor) {
  const Gain gain = sensor_gain(table, "gain", quantity_unit(sensor.reads));
  sensor.gain = gain.value, sensor.unit = gain.unit;
  if (sensor.gain == 0) table.fail("gain", fmt::format("{} is 0", table.full_name("gain")), "wanted a gain that is not zero");
}

/// The row of the calibration matrix of a further bridge.
void take_calibration_row(const TomlTable& table, const Rig& rig, Sensor& sensor) {
  const std::array entries{std::tuple{"per_force", "N", &sensor.row.per_force}, std::tuple{"per_bending_moment", "N.m", &sensor.row.per_bending_moment}, std::tuple{"per_torque", "N.m", &sensor.row.per_torque}};
  for (const auto& [key, quantity, entry] : entries) {
    if (!table.has(key)) continue;
    const Gain gain = sensor_gain(table, key, quantity);
    *entry = gain.value;
    if (!sensor.unit.empty() && sensor.unit != gain.unit)
      table.fail(key, fmt::format("{} makes the reading one in {}, another key one in {}", table.full_name(key), gain.unit, sensor.unit), "wanted one unit of the reading, as \"0.1 V/N\" beside \"2 V/(N.m)\"");
    sensor.unit = gain.unit;
  }
  const CalibrationRow& row = sensor.row;
  if (row.per_force == 0 && row.per_bending_moment == 0 && row.per_torque == 0)
    table.fail("reads", fmt::format("the bridge \"{}\" reads no load", sensor.column), "wanted per_force, per_bending_moment or per_torque, not zero");
  if (sensor.element == rig.station.size()) table.fail("element", fmt::format("the bridge \"{}\" sits at the last element", sensor.column), "wanted elements outboard of it, which load it");
  if (row.per_torque != 0 && sensor.element >= rig.rigid_from)
    table.fail("element", fmt::format("the bridge \"{}\" sits at element {}, in the part that is rigid in torsion", sensor.column, sensor.element), fmt::format("wanted an element below torsion.rigid_from = {} where per_torque is given", rig.rigid_from),
               "The moment of inertia of a rigid part is known as a whole.");
}

/// Sensors of a rig of elements say at which; a rig known only as modes says it mode by mode (`sensor_shape`).
void take_sensors(const TomlTable& file, Rig& rig, bool of_elements) {
  for (const TomlTable& table : file.tables("sensor")) {
    if (!of_elements && table.has("element"))
      table.fail("element", fmt::format("{} stands beside [[modal]], which has no elements", table.full_name("element")), "wanted where the sensor sits as sensor_shape of each [[modal]]");
    Sensor sensor;
    sensor.column = table.text("column");
    sensor.reads = sensor_kind(table);
    const bool is_bridge = sensor.reads == SensorKind::load;
    if (is_bridge) table.allow_only({"column", "reads", "element", "per_force", "per_bending_moment", "per_torque"});
    else table.allow_only({"column", "reads", "element", "gain"});
    if (is_bridge && !of_elements) table.fail("reads", fmt::format("{} is \"load\" beside [[modal]]", table.full_name("reads")), "wanted \"displacement\": what a bridge reads per unit of each mode is its sensor_shape");
    const bool turns = sensor.reads == SensorKind::twist || sensor.reads == SensorKind::twist_rate;
    if (of_elements) sensor.element = element_number(table, "element", turns ? rig.torsion.inertia.size() : rig.station.size());
    if (is_bridge) take_calibration_row(table, rig, sensor);
    else take_sensor_gain(table, sensor);
    const auto same = [&sensor](const Sensor& other) { return other.column == sensor.column; };
    if (std::any_of(rig.sensors.begin(), rig.sensors.end(), same)) {
      table.fail("column", fmt::format("two sensors name the column \"{}\"", sensor.column), "wanted one sensor per column");
    }
    rig.sensors.push_back(sensor);
  }
}

void take_structure(const TomlTable& file, Rig& rig) {
  file.allow_only({"unrig_rig", "name", "section", "normal", "torsion", "submerged", "gauge", "sensor"});
  take_section(file.table("section"), rig);
  take_chains(file, rig);
  if (file.has("gauge")) take_gauge(file.table("gauge"), rig);
  if (file.has("sensor")) take_sensors(file, rig, true);
  if (rig.gauge_element == 0 && rig.sensors.empty()) {
    throw InputError({rig.file, 0}, "the rig has neither [gauge] nor [[sensor]]", "wanted something that measures", "");
  }
}

// ------------------------------------------------------------------------------------------------------ modes only

/// "1000 N/m": what the gauge reads per metre of modal displacement. The unit of the reading is the gain's times metre.
void take_gauge_gain(const TomlTable& table, ModalMode& mode) {
  const InputError::Place place = table.place("gauge_gain");
  const std::string name = table.full_name("gauge_gain");
  const Measure gain = split_quantity(table.text("gauge_gain"), place, name);
  si_unit(gain.unit, place, name);  // so that an unknown unit is reported as it stands in the file
  const std::string reading = fmt::format("({}).(m)", gain.unit);
  mode.gauge_unit = si_unit(reading, place, name);
  mode.gauge_gain = unit_scale(reading, mode.gauge_unit, place, name)(gain.value);
  if (mode.gauge_gain == 0) table.fail("gauge_gain", fmt::format("{} is 0", name), "wanted a gain that is not zero");
}

/// How the mode moves each sensor, per unit of the modal displacement.
void take_sensor_shape(const TomlTable& table, std::size_t sensors, ModalMode& mode) {
  const std::string name = table.full_name("sensor_shape");
  if (sensors == 0) {
    if (table.has("sensor_shape")) table.fail("sensor_shape", fmt::format("{} in a rig without [[sensor]]", name), "wanted a [[sensor]] for each of its numbers");
    return;
  }
  if (!table.has("sensor_shape"))
    table.fail("sensor_shape", fmt::format("{} is missing", name), fmt::format("wanted {} number{}, one per [[sensor]]: what it moves by per unit of the modal displacement", sensors, sensors > 1 ? "s" : ""));
  const Eigen::VectorXd shape = table.numbers("sensor_shape");
  mode.sensor_shape.assign(shape.begin(), shape.end());
  if (mode.sensor_shape.size() != sensors)
    table.fail("sensor_shape", fmt::format("{} has {} numbers", name, mode.sensor_shape.size()), fmt::format("wanted {}, one per [[sensor]] in their order", sensors));
}

/// Of metal on a bolted clamp; a fit adjusts it.
constexpr double usual_damping_ratio = 0.01;

/// A mode of a rig with so many sensors.
ModalMode read_mode(const TomlTable& table, std::size_t sensors, Assumed& assumed) {
  table.allow_only({"mass", "frequency", "damping_ratio", "gauge_gain", "sensor_shape", "mass_std", "mass_std_percent", "frequency_std", "frequency_std_percent", "damping_ratio_std",
                    "damping_ratio_std_percent", "gauge_gain_std", "gauge_gain_std_percent"});
  ModalMode mode;
  mode.mass = table.positive_quantity("mass", "kg");
  mode.frequency = table.positive_quantity("frequency", "Hz");
  mode.damping_ratio = table.number_or("damping_ratio", usual_damping_ratio);
  if (!table.has("damping_ratio")) assumed.push_back(fmt::format("{} = {}", table.full_name("damping_ratio"), usual_damping_ratio));
  if (mode.damping_ratio < 0 || mode.damping_ratio >= 1) {
    table.fail("damping_ratio", fmt::format("{} is {}", table.full_name("damping_ratio"), mode.damping_ratio),
               "wanted a fraction of critical damping, at least 0 and below 1");
  }
  take_sensor_shape(table, sensors, mode);
  if (sensors > 0 && !table.has("gauge_gain"))
    mode.gauge_gain = 0;  // no gauge
  else
    take_gauge_gain(table, mode);
  return mode;
}

/// What no mode moves measures nothing.
void check_sensors_move(const TomlTable& file, const Rig& rig) {
  for (std::size_t s = 0; s < rig.sensors.size(); ++s) {
    if (std::any_of(rig.modal.begin(), rig.modal.end(), [s](const ModalMode& mode) { return mode.sensor_shape[s] != 0; })) continue;
    file.fail("modal", fmt::format("number {} of sensor_shape is 0 in every mode", s + 1), fmt::format("wanted one mode at least that moves the sensor \"{}\"", rig.sensors[s].column));
  }
}

void take_modes(const TomlTable& file, Rig& rig) {
  for (const char* key : {"section", "normal", "torsion", "submerged", "gauge"}) {
    if (file.has(key)) {
      file.fail(key, fmt::format("[{}] stands beside [[modal]]", key), "wanted either a rig of elements or a rig known only as modes");
    }
  }
  file.allow_only({"unrig_rig", "name", "modal", "sensor"});
  if (file.has("sensor")) take_sensors(file, rig, false);
  Assumed assumed;
  for (const TomlTable& table : file.tables("modal")) {
    rig.modal.push_back(read_mode(table, rig.sensors.size(), assumed));
    const auto has_gauge = [](const ModalMode& mode) { return mode.gauge_gain != 0; };
    if (has_gauge(rig.modal.back()) != has_gauge(rig.modal.front()))
      table.fail("gauge_gain", fmt::format("{} is {}, that of the first mode is {}", table.full_name("gauge_gain"), has_gauge(rig.modal.back()) ? "given" : "missing", has_gauge(rig.modal.front()) ? "given" : "missing"),
                 "wanted a gauge_gain in every mode, or in none where there is no gauge");
    if (rig.modal.back().gauge_unit != rig.modal.front().gauge_unit) {
      table.fail(
          "gauge_gain",
          fmt::format("the gauge reads {} for this mode and {} for the first", rig.modal.back().gauge_unit, rig.modal.front().gauge_unit),
          "wanted one unit of the reading");
    }
  }
  check_sensors_move(file, rig);
  say_what_is_assumed(assumed, rig);
}

}  // namespace

Rig read_rig(const std::string& path) { return parse_rig(read_text(path), path); }

Rig parse_rig(const std::string& text, const std::string& path) {
  refuse_other_kinds(text, path, TextKind::rig);
  const TomlTable file = TomlTable::parse(text, path, "Text stands in double quotes, a remark begins with #.");
  check_rig_version(file, path);
  Rig rig;
  rig.file = path;
  rig.name = file.text_or("name", std::filesystem::path(path).stem().string());
  if (file.has("modal")) {
    take_modes(file, rig);
  } else {
    take_structure(file, rig);
  }
  rig.givens = stated_errors(file, rig);
  return rig;
}

}  // namespace unrig
