#include "core/new/run_template.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <numbers>
#include <random>
#include <utility>

#include "core/model/simulate.h"
#include "core/model/wagner.h"
#include "core/rig/structure.h"

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

constexpr double density_of_air = 1.2;  // kg/m^3
constexpr double speed_of_step = 20;    // m/s
constexpr double degree = std::numbers::pi / 180;

/// The next rate of the series 1, 2, 5 above 20 samples a period.
double sampling_rate(double frequency) {
  const double wanted = 20 * frequency, decade = std::pow(10, std::floor(std::log10(wanted)));
  for (const double times : {1.0, 2.0, 5.0})
    if (times * decade >= wanted) return times * decade;
  return 10 * decade;
}

/// From 0 to 1 in `duration`, without a jump of the acceleration (a polynomial of fifth order).
double smooth_rise(double t, double duration) {
  const double x = std::clamp(t / duration, 0.0, 1.0);
  return x * x * x * (10 - 15 * x + 6 * x * x);
}

void add_channel(Run& run, const char* name, const char* unit, const char* file_unit, double factor, VectorXd value) {
  Channel channel;
  channel.name = name;
  channel.unit = unit;
  channel.file_unit = file_unit;
  channel.factor = factor;
  channel.value = std::move(value);
  run.channels.push_back(std::move(channel));
}

/// What drives the run, without noise: a turn of 4 degrees, a blow of a hammer, a mount that sways.
void add_inputs(RunKind kind, double period, Run& run, Index samples) {
  const auto sampled = [&](auto&& f) {
    VectorXd value(samples);
    for (Index k = 0; k < samples; ++k) value[k] = f(run.time(k));
    return value;
  };
  const double begin = 5 * period;
  if (kind == RunKind::step) add_channel(run, "alpha", "rad", "deg", degree, sampled([&](double t) { return degree * (2 + 4 * smooth_rise(t - begin, 2 * period)); }));
  if (kind == RunKind::forced) {
    const double width = 0.1 * period;  // half a sine, as a soft tip gives it
    add_channel(run, "force", "N", "N", 1, sampled([&](double t) { return t < begin || t > begin + width ? 0.0 : 100 * std::sin(std::numbers::pi * (t - begin) / width); }));
  }
  if (kind == RunKind::moved)
    add_channel(run, "mount_acceleration", "m/s^2", "m/s^2", 1, sampled([&](double t) {
                  const double x = (t - 10 * period) / (3 * period);
                  return std::exp(-x * x) * std::sin(2 * std::numbers::pi * 0.8 * t / period);
                }));
}

/// Twelve uniform numbers, less six: normal enough, and the same on every machine (std::normal_distribution is not).
double noise(std::mt19937& generator) {
  double sum = -6;
  for (int k = 0; k < 12; ++k) sum += static_cast<double>(generator()) / 4294967296.0;
  return sum;
}

/// The run with what gauge and sensors would read, all columns with noise of 0.3 % of their range.
Run recorded(RunKind kind, const Rig& rig) {
  const double frequency = lowest_frequency(rig, density_of_air), period = 1 / frequency;
  Run run;
  run.file = "the template";
  run.kind = kind;
  run.density = density_of_air;
  run.speed = kind == RunKind::step ? speed_of_step : 0;
  run.dt = 1 / sampling_rate(frequency);
  const auto samples = static_cast<Index>(std::ceil(40 * period / run.dt));
  add_inputs(kind, period, run, samples);
  if (kind == RunKind::pluck) add_channel(run, "weight", "1", "1", 1, VectorXd::Ones(samples));  // a run has one column at least
  const Basis basis = make_basis(rig, 0.5 / run.dt, run.density);
  SimulateProblem problem{{rig, basis, wagner(Wagner::within_1e4)}, {}, run, {}, {}, {}};
  problem.theta = problem.model.start_values();
  if (kind == RunKind::pluck) problem.release_load = 20;
  SimulateResult result = simulate(problem);
  std::mt19937 generator(1);
  constexpr double relative_noise = 0.003;
  Run out = run;
  out.channels.clear();
  for (Channel& channel : result.run.channels) {
    if (channel.name == "weight" || channel.name == "circulatory" || channel.name == "normal_force") continue;
    const double std = relative_noise * (channel.value.maxCoeff() - channel.value.minCoeff());
    for (double& x : channel.value) x += std * noise(generator);
    out.channels.push_back(std::move(channel));
  }
  return out;
}

std::string head(RunKind kind, const Rig& rig) {
  std::string text =
      "# unrig_run = 1\n"
      "# # One recording: its conditions in lines that begin with \"# \", then a row of names with units, then one row a sample. A remark begins with \"# #\".\n"
      "# # Lines that begin with \"# # ?\" ask what only you know. The rows are an example: a simulation of the rig \"" + rig.name + "\" with noise. Put yours in their place.\n"
      "# # ? What do reports call the run?\n";
  text += fmt::format("# name = \"{} example\"\n", to_string(kind));
  text += "# # ? step: the shaft turns, from rest. pluck: a free decay. forced: a measured force drives the rig. moved: the mount itself moves.\n";
  text += fmt::format("# kind = \"{}\"\n", to_string(kind));
  text +=
      "# # ? Which fluid, how dense, how fast? The density is what counts: water 998 kg/m^3, air 1.2 kg/m^3. A still tank: \"0 m/s\".\n"
      "# medium = \"air\"\n";
  text += fmt::format("# density = \"{} kg/m^3\"\n# speed = \"{} m/s\"\n", density_of_air, kind == RunKind::step ? speed_of_step : 0);
  text +=
      "# # speed_std_percent = 0.5 would say how well it is known: one standard deviation. density_std_percent likewise.\n"
      "# # ? Is the gauge in newtons, as an equivalent normal force where the dead weights hung? In volts: write [V] in the row of names, and here calibration = \"4.4 N/V\".\n";
  if (kind == RunKind::step) text += "# # alpha: measured angle of attack, nose up. Let the rig rest before the motion and behind it.\n";
  if (kind == RunKind::pluck) text += "# # The first row is the release or later, or a hold still before it: a constant reading for twelve samples or more.\n";
  if (kind == RunKind::forced) text += "# # force: the hammer's, positive like the normal force. In volts: force_calibration = \"22 N/V\".\n";
  if (kind == RunKind::moved) text += "# # mount_acceleration (or mount_velocity): of the mount, along the normal force.\n";
  for (const Sensor& sensor : rig.sensors) text += fmt::format("# # {}: the column of the rig file's [[sensor]].\n", sensor.column);
  return text;
}

}  // namespace

std::string run_template(RunKind kind, const Rig& rig) {
  if (kind == RunKind::step && rig.is_modal())
    throw InputError({rig.file, 0}, "the rig is known only as modes", "wanted a run without an angle of attack: --kind pluck, forced or moved", "");
  const Run run = recorded(kind, rig);
  std::string text = head(kind, rig) + "time [s]";
  auto out = std::back_inserter(text);
  for (const Channel& channel : run.channels) fmt::format_to(out, ",{} [{}]", channel.name, channel.file_unit.empty() ? channel.unit : channel.file_unit);
  text += '\n';
  for (Index k = 0; k < run.samples(); ++k) {
    fmt::format_to(out, "{:.7g}", run.time(k));
    for (const Channel& channel : run.channels) fmt::format_to(out, ",{:.5g}", channel.value[k] / channel.factor);
    text += '\n';
  }
  return text;
}

}  // namespace unrig
