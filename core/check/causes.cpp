#include "core/check/causes.h"

#include "core/check/run_estimate.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

namespace unrig {
namespace {

constexpr double pound_force = 4.4482216152605, pound = 0.45359237, inch = 25.4, gravity = 9.80665;
constexpr double degrees = 180 / std::numbers::pi;

Channel* column(Run& run, std::string_view name) {
  const auto found = std::find_if(run.channels.begin(), run.channels.end(), [&](const Channel& c) { return c.name == name; });
  return found == run.channels.end() ? nullptr : &*found;
}

bool has_both(const Run& run) { return (run.kind == RunKind::step || run.kind == RunKind::pluck) && run.find("alpha") && run.find("gauge"); }
bool has_angle(const Run& run) { return run.kind == RunKind::step && run.find("alpha") && run.find("gauge"); }
bool flows(const Run& run) { return has_angle(run) && run.speed > 0; }
bool turns_in_a_decay(const Run& run) { return run.kind == RunKind::pluck && run.find("alpha") && shaft_turns(run.channel("alpha").value); }
bool step_without_motion(const Run& run) { return run.kind == RunKind::step && run.find("alpha") && !shaft_turns(run.channel("alpha").value); }
bool always(const Run&) { return true; }

std::string times(double factor) { return fmt::format("{:.4g} times", factor); }

/// A column that reads `factor` times what it should.
RunCause scaled(const char* name, double factor, std::string words, double price = 0) {
  const std::string what = std::string(name) == "gauge" ? "the gauge reads " : "the angle is ";
  const std::string says = factor > 0 ? what + times(factor) + " what {} say" : std::string("gauge and angle have opposite signs (-1 times what {} say)");
  return {{says, std::move(words), factor, price}, has_angle, [=](Run& run) { column(run, name)->value /= factor; }};
}

RunCause other_clock(double factor, std::string words, double price = 0) {
  return {{"its time is " + times(factor) + " what {} say", std::move(words), factor, price}, always, [=](Run& run) { run.dt /= factor, run.start /= factor; }};
}

RunCause other_speed(double factor, std::string words, double price) {
  return {{"the speed is " + times(factor) + " what {} say", std::move(words), factor, price}, flows, [=](Run& run) { run.speed /= factor; }};
}

/// A header's density that belongs to another fluid. `lowest`, `highest`: for which the slip is likely.
RunCause other_density(double factor, double lowest, double highest, std::string words) {
  return {{"the density is " + times(factor) + " what {} say", std::move(words), factor, 0}, [=](const Run& run) { return run.density >= lowest && run.density <= highest; }, [=](Run& run) { run.density /= factor; }};
}

/// The numbers of either column in the place of the other's.
void exchange_columns(Run& run) {
  Channel &alpha = *column(run, "alpha"), &gauge = *column(run, "gauge");
  Eigen::VectorXd angle = gauge.value * (alpha.factor / gauge.factor), load = alpha.value * (gauge.factor / alpha.factor);
  alpha.value = std::move(angle);
  gauge.value = std::move(load);
}

std::vector<RunCause> make_run_causes() {
  std::vector<RunCause> causes{
      scaled("gauge", -1, "the sign of the gauge?"),
      scaled("alpha", -1, "the sign of the angle?"),
      scaled("gauge", pound_force, "newtons in a column labelled lbf (lbf written for N)?"),
      scaled("gauge", 1 / pound_force, "pounds in a column labelled N (N written for lbf)?"),
      scaled("gauge", 1000, "newtons in a column labelled kN (kN written for N)?"),
      scaled("gauge", 1e-3, "kilonewtons in a column labelled N (N written for kN)?"),
      scaled("gauge", gravity, "newtons in a column labelled kgf?", 3),
      scaled("gauge", 1 / gravity, "kilograms in a column labelled N?", 3),
      scaled("alpha", degrees, "degrees in a column labelled rad (degrees written as radians)?"),
      scaled("alpha", 1 / degrees, "radians in a column labelled deg (radians written as degrees)?"),
      other_clock(2, "the clock runs twice too slow: half of the true sampling rate written?"),
      other_clock(0.5, "the clock runs twice too fast: twice the true sampling rate written?"),
      other_clock(1000, "milliseconds in a column labelled s (ms written as s)?"),
      other_clock(1e-3, "seconds in a column labelled ms (s written as ms)?"),
      other_clock(10, "a tenth of the true sampling rate written?", 6),
      other_clock(0.1, "ten times the true sampling rate written?", 6),
      other_speed(2, "twice the true speed written?", 0),
      other_speed(0.5, "half of the true speed written?", 0),
      other_speed(1 / 0.3048, "ft/s written as m/s?", 1),
      other_speed(0.3048, "m/s written as ft/s?", 1),
      other_speed(3.6, "km/h written as m/s?", 4),
      other_speed(1 / 3.6, "m/s written as km/h?", 4),
      other_speed(1 / 0.514444, "knots written as m/s?", 6),
      other_speed(1 / 0.44704, "miles per hour written as m/s?", 6),
      other_density(1.2 / 998.2, 1.0, 1.5, "a run in water labelled air?"),
      other_density(998.2 / 1.2, 900, 1100, "a run in air labelled water?"),
      other_density(1e-3, 0.7, 1.0, "g/cm^3 written as kg/m^3 (g/cc)?"),
      other_density(1000, 9e5, 1.2e6, "kg/m^3 written as g/cm^3?"),
      other_density(1 / 16.0185, 55, 70, "lb/ft^3 written as kg/m^3?"),
  };
  causes.push_back({{"the angle rings and the gauge does not", "the columns alpha and gauge exchanged?", 1, 1}, has_both, exchange_columns});
  causes.push_back({{"the shaft turns in a run labelled pluck", "a step (kind = \"step\")?", 1, 3}, turns_in_a_decay, [](Run& run) { run.kind = RunKind::step; }});
  causes.push_back({{"the angle never changes in a run labelled step", "a free decay (kind = \"pluck\"), an encoder without a signal, or a record without its beginning?", 1, 0}, step_without_motion, [](Run& run) { run.kind = RunKind::pluck; }});
  return causes;
}

bool is_beam(const Rig& rig) { return !rig.is_modal(); }

RigCause other_mass(double factor, std::string words) {
  return {{"the masses are " + times(factor) + " what {} say", std::move(words), factor, 1}, is_beam, [=](Rig& rig) { rig.normal.inertia /= factor, rig.torsion.inertia /= factor; }};
}

RigCause other_flexibility(double factor, std::string words) {
  return {{"the flexibility is " + times(factor) + " what {} say", std::move(words), factor, 1}, is_beam, [=](Rig& rig) { rig.normal.flexibility /= factor; }};
}

RigCause other_chord(double factor, std::string words) {
  return {{"the chord is " + times(factor) + " what {} say", std::move(words), factor, 1}, is_beam, [=](Rig& rig) { rig.chord /= factor; }};
}

RigCause other_strips(double factor, std::string words) {
  return {{"the strips' length is " + times(factor) + " what {} say", std::move(words), factor, 1}, is_beam, [=](Rig& rig) { rig.strip_length /= factor; }};
}

std::vector<RigCause> make_rig_causes() {
  return {
      other_mass(1 / pound, "kg written for lb?"),
      other_mass(pound, "lb written for kg?"),
      other_mass(1000, "kg written for g?"),
      other_mass(1e-3, "g written for kg?"),
      other_flexibility(1000, "the flexibility's scale, 1e-3 for 1e-6?"),
      other_flexibility(1e-3, "the flexibility's scale, 1e-6 for 1e-3?"),
      other_flexibility(1e6, "the flexibility's scale, 1 for 1e-6?"),
      other_chord(1 / inch, "the chord in mm for in?"),
      other_chord(inch, "the chord in in for mm?"),
      other_chord(10, "the chord in cm for mm?"),
      other_chord(0.1, "the chord in mm for cm?"),
      other_chord(0.5, "the semichord written for the chord?"),
      other_strips(1 / inch, "the strips' length in mm for in?"),
      other_strips(inch, "the strips' length in in for mm?"),
  };
}

}  // namespace

const std::vector<RunCause>& run_causes() {
  static const std::vector<RunCause> causes = make_run_causes();
  return causes;
}

const std::vector<RigCause>& rig_causes() {
  static const std::vector<RigCause> causes = make_rig_causes();
  return causes;
}

}  // namespace unrig
