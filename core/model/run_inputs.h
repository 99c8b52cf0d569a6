#pragma once
#include <Eigen/Core>

#include "core/model/aeroelastic_model.h"
#include "core/run/run.h"

namespace unrig {

/// The measured inputs of a run in the order of LinearSystem: force [N], velocity [m/s] and acceleration [m/s^2] of the mount, as far as
/// `conditions` has them, then their second derivatives in time. One row per sample and one more, the last repeated, so that the step behind the last sample has an end.
///
/// Between samples an input is straight, which loses (w dt)^2/12 of a component of angular frequency w. Behind a filter against aliasing the samples say more: the cubic spline through
/// them loses (w dt)^4/720 (M. Unser, IEEE Signal Processing Magazine 16(6) (1999) 22). It is taken where straight lines lose more power than the record has at its Nyquist
/// frequency, be that noise or what its samples do not resolve; elsewhere second derivatives are zero.
/// Missing samples lie on the line between their neighbours, before the spline goes through them. A force that `conditions` has and the run does not is zero. Where only one of velocity and acceleration of the
/// mount is measured the other is its central difference, or its integral by the trapezoidal rule with the mean of the acceleration
/// removed, because a constant offset would run away.
Eigen::MatrixXd run_inputs(const Run& run, const Conditions& conditions);

}  // namespace unrig
