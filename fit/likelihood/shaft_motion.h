#pragma once
#include <Eigen/Core>
#include <optional>

#include "core/rig/rig.h"
#include "core/run/run.h"

namespace unrig {

/// What the shaft did, from a measured angle.
struct ShaftMotion {
  Eigen::VectorXd angle;  ///< rad, one per sample: at rest outside the windows in which the readings move, in them the smooth motion nearest to the readings
  double noise = 0;       ///< standard deviation of the readings, rad
};

/// The motion of a step run as its column `alpha` alone says it: the spline of core/run/motion.h in the windows of `motion_windows`, as smooth as the readings show it to be
/// (fit/likelihood/motion_prior.h). Twice differentiated, the noise of the readings would shake a simulated rig harder than the step does: white noise of sigma has accelerations of some
/// sigma / dt^2. Nothing where the angle needs none of this (no step, nothing moves, at rest it does not scatter) or cannot have it (no rest; so much motion that knots lie further apart
/// than the samples).
std::optional<ShaftMotion> shaft_motion(const Rig& rig, const Run& run);

}  // namespace unrig
