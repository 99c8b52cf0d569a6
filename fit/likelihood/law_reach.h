#pragma once
#include <map>
#include <string>
#include <vector>

#include "core/law/learnt_range.h"
#include "fit/likelihood/joint_problem.h"
#include "fit/likelihood/run_residual.h"

namespace unrig {

/// What the laws at work look at over a run, in the motion, start and inputs that the model at theta finds in its readings; empty where it runs away. Of a run in one piece. What a wandering force adds is not in it.
std::vector<Sight> seen_by_laws(const RunResidual& run, const Eigen::VectorXd& theta, Sights which);

/// Over all runs that have a part in the fit, by the laws' ids, in four digits outward.
std::map<std::string, LearntOn> reach_of_laws(const JointProblem& joint);

}  // namespace unrig
