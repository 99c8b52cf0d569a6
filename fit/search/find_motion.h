#pragma once
#include <Eigen/Core>
#include <functional>

#include "fit/likelihood/run_residual.h"

namespace unrig {

/// Leads a run whose motion is estimated to what its readings say under nonlinear laws, by continuation; `search` is called wherever the next estimate is due, and starts from the one before.
///
/// The least chi-squares of a motion are many: jerks of single knots, which the angle hardly sees, bend the trajectory of a law that is not followed yet. So this begins at the motion that the
/// angle alone shows, as smooth as it shows it to be (fit/likelihood/motion_prior.h), and lets the gauge in by and by, its noise taken for larger by a factor that falls to 1. Then the prior goes
/// in the same way. Leaves the run with its noise as it is, and without a prior.
/// Source: E. L. Allgower and K. Georg, Numerical Continuation Methods (1990), ch. 1 (embedding).
void lead_in(RunResidual& run, const Eigen::VectorXd& theta, const std::function<void()>& search);

/// Searches the linear unknowns c of a run under nonlinear laws from afar, at theta. Leaves the best found as where the run's next search begins; false where the model is linear.
/// Under laws with corners that ask for small steps, and of a free decay, c is searched over a part of the record that grows (RunResidual::find_linear, also for `thoroughly`): a gap
/// (open2/a3) is followed better so, in a quarter of the time. Elsewhere by `lead_in`.
bool find_motion(RunResidual& run, const Eigen::VectorXd& theta, bool thoroughly = false);

}  // namespace unrig
