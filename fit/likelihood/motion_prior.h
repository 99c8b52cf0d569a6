#pragma once
#include <Eigen/Core>

#include "fit/likelihood/run_residual.h"

namespace unrig {

/// How rough the motion is, learned from the run itself.
///
/// Neither channel sees the fastest wiggles of the shaft well: the angle is noisy, and a section that is shaken fast about its pitch axis hardly
/// bends the rig. A spline with a knot on every sample therefore carries noise that a drive cannot make. Its fourth differences, changes of the third derivative, get normal priors
/// around zero, d_j ~ N(0, tau_g^2), with one scale per group of neighbouring knots, so that a kink stays a kink and a ring-down
/// stays smooth. The scales maximise the evidence (MacKay 1992), where tau_g^2 = sum d_j^2 / gamma_g with gamma_g the number of differences in the group that
/// the data determine, times a prior of their own: ln tau_g^2 of neighbouring groups, five knots apart (up to twenty where the shaft moves for long), differ by N(0, 1) times the
/// knots' distance in samples, so that what five differences happen to be does not stand for how rough the motion is. Each group is then as wide as the wider of its neighbours.
///
/// Returns the rows d_j / tau_g over the run's linear unknowns (RunResidual::set_motion_prior), at theta. Empty without motion, and where the model runs away at theta.
Eigen::MatrixXd motion_prior(const RunResidual& residual, const Eigen::VectorXd& theta);

}  // namespace unrig
