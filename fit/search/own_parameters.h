#pragma once
#include "fit/likelihood/joint_problem.h"

namespace unrig {

/// Runs whose motion is estimated, under a nonlinear law: the parameters that a run has of its own (the slope of its normal force) are searched for run by run, what all share held, until its
/// gauge is explained. Small errors of them turn a trajectory where the true one passes, and no search of everything at once leads back from there. Where it is not found from where they stand, and they have gone astray, the rig's own are searched from
/// where the rig file has them: a fit without the law may have taken them anywhere. `astray`: only runs that are left with more than so much times the power of their noise.
void fit_own_parameters(JointProblem& joint, double astray = 0);

}  // namespace unrig
