#pragma once
#include <string>

#include "fit/joint_problem.h"

namespace unrig {

/// Whether any of the runs is a free decay or is driven by what is measured: its motion is not estimated.
bool has_decays(const JointProblem& joint);

/// Fits the runs of `joint` whose motion is not estimated, at the noise level that each has, and leaves what it finds in `joint`. theta and the linear unknowns c
/// are searched side by side over a record that grows from a few samples: with a strongly nonlinear effect at work c has least chi-squares everywhere, and a
/// search that eliminates it at every theta (RunResidual) follows the wrong one. Returns chi-square over the degrees of freedom.
double fit_decays(JointProblem& joint);

/// The same from the present size of effect `id` (its first parameter) and, where that leaves more than the noise, from smaller and larger ones; the best.
double fit_decays(JointProblem& joint, const std::string& id);

}  // namespace unrig
