#pragma once
#include <Eigen/Core>

#include "core/model/aeroelastic_model.h"
#include "core/run/run.h"

namespace unrig {

/// The measured inputs of a run in the order of LinearSystem: force [N], velocity [m/s] and acceleration [m/s^2] of the mount, as far as
/// `conditions` has them. One row per sample and one more, the last repeated, so that the step behind the last sample has an end.
///
/// Missing samples lie on the line between their neighbours. Where only one of velocity and acceleration of the
/// mount is measured the other is its central difference, or its integral by the trapezoidal rule with the mean of the acceleration
/// removed, because a constant offset would run away.
Eigen::MatrixXd run_inputs(const Run& run, const Conditions& conditions);

}  // namespace unrig
