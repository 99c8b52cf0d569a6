#include "fit/check/summary.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <limits>
#include <numbers>

#include "core/check/run_estimate.h"
#include "core/model/aeroelastic_model.h"
#include "core/model/wagner.h"
#include "core/rig/bridge.h"
#include "core/rig/structure.h"
#include "core/run/motion.h"

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::VectorXd;
using std::numbers::pi;

constexpr std::size_t most_modes = 8;

std::vector<RigMode> modes_of(const AeroelasticModel& model, double density, double speed) {
  Conditions conditions;
  conditions.density = density;
  conditions.speed = speed;
  std::vector<RigMode> modes;
  for (const std::complex<double> pole : oscillatory_poles(model.system(conditions, model.start_values(), {}))) {
    if (modes.size() == most_modes) break;
    modes.push_back({pole.imag() / (2 * pi), -pole.real() / std::abs(pole)});
  }
  return modes;
}

RigInMedium in_medium(const AeroelasticModel& model, const std::string& name, double density, double speed) {
  const Rig& rig = model.rig();
  RigInMedium medium{name, density, speed, modes_of(model, density, speed), 0, 0, 0};
  if (rig.is_modal()) return medium;
  const double span = rig.strip_length * static_cast<double>(rig.submerged.size()), b = rig.semichord();
  medium.apparent_mass = pi * density * b * b * span;
  medium.load_per_degree = density * speed * speed * b * span * 2 * pi * (pi / 180);
  if (rig.gauge_element > 0) medium.gauge_per_degree = reading_of_unit_coefficient(rig, gauge_levers(rig), density, speed) * 2 * pi * (pi / 180);
  return medium;
}

/// Share of the white part in the variance about a straight line.
double white_share(const VectorXd& rest, double noise) {
  const VectorXd t = VectorXd::LinSpaced(rest.size(), -1, 1);
  const VectorXd off = (rest.array() - rest.mean()).matrix() - t * (t.dot(rest) / t.squaredNorm());
  const double variance = off.squaredNorm() / static_cast<double>(rest.size());
  return variance > 0 ? std::min(1.0, noise * noise / variance) : 1.0;
}

VectorXd numbers_of(const VectorXd& x) {
  std::vector<double> there;
  for (const double v : x)
    if (std::isfinite(v)) there.push_back(v);
  return Eigen::Map<const VectorXd>(there.data(), static_cast<Index>(there.size()));
}

ChannelSummary channel_summary(const Channel& channel, const StepMotion& motion) {
  ChannelSummary summary{channel.name, channel.unit, 0, 0, 0, 0, {}, channel.missing, channel.clipped, channel.bad, 0};
  const VectorXd x = numbers_of(channel.value);
  constexpr Index least = 32;
  if (x.size() == 0) return summary;
  summary.minimum = x.minCoeff();
  summary.maximum = x.maxCoeff();
  summary.mean = x.mean();
  if (x.size() < least) return summary;
  summary.noise = noise_level(channel.value);
  VectorXd value = channel.value;
  if (channel.name == "alpha" && summary.noise > 0) {
    const std::vector<bool> spikes = isolated_spikes(value, summary.noise, moving(value, summary.noise));
    summary.spikes = static_cast<std::size_t>(std::count(spikes.begin(), spikes.end(), true));
    for (Index k = 0; k < value.size(); ++k)
      if (spikes[static_cast<std::size_t>(k)]) value[k] = std::numeric_limits<double>::quiet_NaN();
  }
  const VectorXd rest = motion.found ? numbers_of(value.head(motion.begin - motion.begin / 10)) : VectorXd();  // a motion begins before it leaves the angle's noise
  if (rest.size() >= least) summary.white_share = white_share(rest, summary.noise);
  return summary;
}

/// The model with a fit's modes for the fastest of the runs, or the rig file's below 1 kHz.
AeroelasticModel model_for(const Rig& rig, const std::vector<Run>& runs) {
  if (rig.is_modal()) return {rig, {}, wagner(Wagner::within_1e4)};
  double nyquist = runs.empty() ? 1000.0 : 0.0, density = 1000;
  for (const Run& run : runs) nyquist = std::max(nyquist, 0.5 / run.dt);
  return {rig, make_basis(rig, std::max(nyquist, 1.0), density), wagner(Wagner::within_1e4)};
}

}  // namespace

RigSummary summary_of(const Rig& rig, const std::vector<Run>& runs) {
  RigSummary summary;
  summary.name = rig.name;
  summary.modal = rig.is_modal();
  const AeroelasticModel model = model_for(rig, runs);
  if (rig.is_modal()) {
    for (const ModalMode& mode : rig.modal) summary.mass += mode.mass;
    summary.media.push_back(in_medium(model, "vacuum", 0, 0));
    return summary;
  }
  summary.mass = rig.normal.inertia.sum();
  const Index loaded = rig.loaded_element() - 1;
  summary.loaded_element = rig.loaded_element();
  summary.deflection = rig.normal.flexibility(loaded, loaded);
  if (rig.gauge_element > 0) summary.gauge_per_newton = reading_of_unit_load(rig, gauge_levers(rig));
  constexpr double air = 1.2;
  summary.media.push_back(in_medium(model, "vacuum", 0, 0));
  summary.media.push_back(in_medium(model, "air", air, 0));
  for (const Run& run : runs) {
    const bool known = std::any_of(summary.media.begin(), summary.media.end(), [&](const RigInMedium& m) { return m.density == run.density && m.speed == run.speed; });
    if (!known) summary.media.push_back(in_medium(model, run.medium.empty() ? "fluid" : run.medium, run.density, run.speed));
  }
  return summary;
}

RunSummary summary_of(const Rig& rig, const Run& run) {
  RunSummary summary;
  summary.file = run.file;
  summary.kind = to_string(run.kind);
  summary.medium = run.medium;
  summary.density = run.density;
  summary.speed = run.speed;
  summary.samples = run.samples();
  summary.rate = 1 / run.dt;
  summary.duration = run.dt * static_cast<double>(run.samples());
  summary.resampled = run.resampled;
  summary.hold = run.hold;
  const CheckModel check(rig);
  const RunEstimate estimated = estimate(check, run);
  summary.ringing = estimated.line;
  const double rest = estimated.modelled > 0 ? 1 / estimated.modelled : 0.0;
  const StepMotion motion = run.kind == RunKind::step ? step_motion(run, rest) : StepMotion{};
  summary.moves = motion.found;
  if (motion.found) {
    summary.motion_begin = run.time(motion.begin);
    summary.motion_end = run.time(motion.end);
    summary.onset = motion.onset;
    summary.step = motion.step;
  }
  for (const Channel& channel : run.channels)
    if (channel.name != "weight") summary.channels.push_back(channel_summary(channel, motion));
  return summary;
}

}  // namespace unrig
