#pragma once
#include <Eigen/Core>
#include <optional>
#include <random>
#include <vector>

#include "core/rig/rig.h"
#include "core/run/run.h"

namespace unrig {

/// A run of a campaign that is going to be simulated.
struct PlannedRun {
  static constexpr Eigen::Index finer = 4;  ///< simulated steps per recorded one

  Run fine;                 ///< conditions and the shaft's angle, in steps `finer` times finer than the recorded ones
  double release = 0;       ///< N at the calibration element, of a pluck
  double slope = 0;         ///< normal force per radian
  double steady = 0;        ///< normal-force coefficient before the motion
  double noise = 0;         ///< N
  double angle_noise = 0;   ///< rad
  Run disturbed = {};       ///< what the readings have beside noise: spikes of the angle, NaN where a sample is missing; no channels: nothing
};

/// A pluck in air and one in water, released from 15 to 30 N, and three steps of 1.3 to 2.5 degrees from 2, 4 and 25 degrees at two speeds, recorded every 2 ms with an angle noise of 0.01 degrees.
std::vector<PlannedRun> draw_runs(double noise, std::mt19937_64& random);

/// The same conditions, durations and sampling as in recordings, moved and released as there: the shaft's angle is the motion that the recorded one says (fit/likelihood/shaft_motion.h), the release load what
/// the gauge begins with. The white part of their noises (unless `noise` sets that of the gauge), spikes of the angle and missing samples of a step; the angle of a pluck is nought with a noise of
/// 0.01 degrees. Sensors, weights and coloured noise are not repeated. Lift slopes are drawn, one for angles of attack below 12 degrees and one for each
/// run beyond.
///
/// Throws InputError for a run that is neither pluck nor step, has no gauge in newtons, or whose shaft never rests: its motion is not told from the noise of its angle.
std::vector<PlannedRun> runs_like(const Rig& rig, const std::vector<Run>& recordings, std::optional<double> noise, std::mt19937_64& random);

/// Evenly distributed.
double between(std::mt19937_64& random, double low, double high);

/// Every n-th sample.
Run every_nth(const Run& fine, Eigen::Index n);

}  // namespace unrig
