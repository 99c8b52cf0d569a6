#include "fit/trial/trial_plan.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <tuple>

#include "core/effects/effect.h"
#include "core/files/error.h"
#include "core/numerics/median.h"
#include "core/run/motion.h"
#include "core/numerics/smooth_ramp.h"
#include "fit/likelihood/run_residual.h"
#include "fit/likelihood/shaft_motion.h"

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::VectorXd;
using std::numbers::pi;
using Random = std::mt19937_64;

constexpr double dt = 0.002, pluck_seconds = 5, step_seconds = 6, degree = pi / 180, angle_noise = 0.01 * degree;
constexpr double stalled = 12 * degree;

double attached_slope(Random& random) { return between(random, 5, 2 * pi); }

/// Slope and steady coefficient of a stalled section.
struct Stalled {
  double steady, slope;
};
Stalled draw_stalled(double attached, Random& random) {
  const double steady = between(random, 0.8, 1.0);
  return {steady, between(random, 0.5, 0.7) * attached};
}

PlannedRun drawn_run(const std::string& name, RunKind kind, double density, double speed, double seconds, double noise) {
  PlannedRun planned;
  planned.noise = noise;
  planned.angle_noise = angle_noise;
  Run& run = planned.fine;
  run.file = name + ".csv";
  run.name = name;
  run.kind = kind;
  run.medium = density > 100 ? "water" : "air";
  run.density = density;
  run.speed = speed;
  run.dt = dt / PlannedRun::finer;
  run.channels.push_back({"alpha", "rad", "rad", 1, VectorXd::Zero(PlannedRun::finer * static_cast<Index>(std::lround(seconds / dt)))});
  return planned;
}

PlannedRun step_run(const std::string& name, double speed, double onset, double step, double noise, Random& random) {
  PlannedRun planned = drawn_run(name, RunKind::step, 998.2, speed, step_seconds, noise);
  const double begin = 1, ramp = log_between(random, 0.06, 0.12);
  VectorXd& alpha = planned.fine.channels.front().value;
  for (Index k = 0; k < alpha.size(); ++k) alpha[k] = (onset + step * smooth_ramp((planned.fine.time(k) - begin) / ramp)) * degree;
  return planned;
}

/// The spline through the samples of an angle, `finer` times as densely.
VectorXd between_samples(const VectorXd& angle) {
  const Motion motion = interpolated_motion(angle, 1);
  VectorXd fine(PlannedRun::finer * angle.size());
  for (Index k = 0; k < angle.size(); ++k)
    for (Index i = 0; i < PlannedRun::finer; ++i) {
      const double t = static_cast<double>(i) / static_cast<double>(PlannedRun::finer);
      const double jerk = k + 1 < angle.size() ? motion.jerk[k] : 0;
      fine[PlannedRun::finer * k + i] = angle[0] + motion.angle[k] + t * (motion.rate[k] + t * (motion.acceleration[k] / 2 + t * jerk / 6));
    }
  return fine;
}

/// What a reading has beside its noise: NaN where a sample is missing, and spikes.
VectorXd beside_noise(const VectorXd& recorded, const VectorXd& truth, double noise, bool spikes) {
  constexpr double limit = 6;
  VectorXd beside = VectorXd::Zero(recorded.size());
  for (Index k = 0; k < recorded.size(); ++k) {
    if (!std::isfinite(recorded[k])) beside[k] = recorded[k];
    else if (const double off = recorded[k] - truth[k]; spikes && std::abs(off) > limit * noise) beside[k] = off;
  }
  return beside;
}

/// What the gauge begins with, above the mean of the record: under a load at the calibration element it reads that load. The middle of the first five readings, so that a spike is none.
double release_load(const VectorXd& gauge) {
  std::vector<double> there;
  for (const double reading : gauge)
    if (std::isfinite(reading)) there.push_back(reading);
  if (there.empty()) return 0;
  const double mean = VectorXd::Map(there.data(), static_cast<Index>(there.size())).mean();
  there.resize(std::min<std::size_t>(5, there.size()));
  return std::abs(median(there) - mean);
}

void move_like(const Rig& rig, const Run& recording, PlannedRun& planned) {
  VectorXd angle = recording.channel("alpha").value;
  const VectorXd recorded = angle;
  if (const std::optional<ShaftMotion> motion = shaft_motion(rig, recording)) {
    angle = motion->angle;
    planned.angle_noise = motion->noise;
  } else if (const std::vector<MotionBasis::Window> windows = motion_windows(recording); windows.empty() || windows.front().stride > 1 || !angle.allFinite())
    throw InputError({recording.file, recording.header_line}, "the shaft never rests, or never moves", "wanted a step with a rest before and after it",
                     "Leave the run away: its motion could not be told from the noise of its angle.");
  planned.fine.channels.push_back({"alpha", "rad", "rad", 1, between_samples(angle)});
  planned.disturbed.channels.push_back({"alpha", "rad", "rad", 1, beside_noise(recorded, angle, planned.angle_noise, true)});
}

}  // namespace

double between(Random& random, double low, double high) { return std::uniform_real_distribution<double>(low, high)(random); }

Run every_nth(const Run& fine, Index n) {
  Run run = fine;
  run.dt = fine.dt * static_cast<double>(n);
  for (Channel& c : run.channels) {
    const Index samples = (c.value.size() + n - 1) / n;
    VectorXd kept(samples);
    for (Index k = 0; k < samples; ++k) kept[k] = c.value[n * k];
    c.value = kept;
  }
  return run;
}

std::vector<PlannedRun> draw_runs(double noise, Random& random) {
  const double speed = log_between(random, 0.5, 0.7), slope = attached_slope(random);
  std::vector<PlannedRun> runs;
  for (const double density : {1.2, 998.2}) {
    runs.push_back(drawn_run(density > 100 ? "wet_pluck" : "dry_pluck", RunKind::pluck, density, 0, pluck_seconds, noise));
    runs.back().release = log_between(random, 15, 30);
    runs.back().slope = slope;
  }
  for (const auto& [name, relative_speed, onset, step] : {std::tuple{"step_a", 1.0, 2.0, 1.3}, std::tuple{"step_b", 0.8, 4.0, 2.5}}) {
    runs.push_back(step_run(name, relative_speed * speed, onset, step, noise, random));
    runs.back().slope = slope;
    runs.back().steady = slope * onset * degree;
  }
  const Stalled beyond = draw_stalled(slope, random);
  runs.push_back(step_run("step_c", speed, 25, 1.5, noise, random));
  runs.back().slope = beyond.slope;
  runs.back().steady = beyond.steady;
  return runs;
}

std::vector<PlannedRun> runs_like(const Rig& rig, const std::vector<Run>& recordings, std::optional<double> noise, Random& random) {
  const double slope = attached_slope(random);
  std::vector<PlannedRun> runs;
  for (const Run& recording : recordings) {
    const InputError::Place place{recording.file, recording.header_line};
    if (recording.kind != RunKind::pluck && recording.kind != RunKind::step)
      throw InputError(place, fmt::format("a run of kind \"{}\"", to_string(recording.kind)), "wanted plucks and steps", "Leave the run away.");
    const Channel& gauge = recording.channel("gauge");
    if (gauge.unit != "N") throw InputError(place, fmt::format("a gauge in {}", gauge.unit), "wanted newtons", "Give its calibration in the run file.");
    PlannedRun planned;
    planned.fine = planned.disturbed = recording;
    planned.fine.channels.clear();
    planned.disturbed.channels.clear();
    planned.fine.dt /= PlannedRun::finer;
    planned.slope = slope;
    planned.angle_noise = angle_noise;
    planned.noise = noise ? *noise : noise_level(gauge.value);
    if (!(planned.noise > 0)) throw InputError(place, "the gauge has no noise", "wanted a recording", "Or say with --noise how much it has.");
    if (recording.kind == RunKind::step) {
      move_like(rig, recording, planned);
      const double onset = planned.fine.channel("alpha").value[0];
      planned.steady = slope * onset;
      if (std::abs(onset) > stalled) {
        const Stalled beyond = draw_stalled(slope, random);
        planned.slope = beyond.slope;
        planned.steady = onset < 0 ? -beyond.steady : beyond.steady;
      }
    } else {
      planned.release = release_load(gauge.value);
      planned.fine.channels.push_back({"alpha", "rad", "rad", 1, VectorXd::Zero(PlannedRun::finer * recording.samples())});
    }
    planned.disturbed.channels.push_back({"gauge", "N", "N", 1, beside_noise(gauge.value, gauge.value, planned.noise, false)});
    runs.push_back(std::move(planned));
  }
  return runs;
}

}  // namespace unrig
