#pragma once
#include "fit/likelihood/joint_problem.h"

namespace unrig {

/// Runs whose motion is estimated, under a nonlinear law: the parameters that a run has of its own (the slope of its normal force) are searched for run by run, what all share held, until its
/// gauge is explained. Small errors of them turn a trajectory where the true one passes, and no search of everything at once leads back from there.
void fit_own_parameters(JointProblem& joint);

}  // namespace unrig
