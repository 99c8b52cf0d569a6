#pragma once
#include <string>

#include "fit/joint_problem.h"

namespace unrig {

/// Whether any of the runs is a free decay or is driven by what is measured: its motion is not estimated.
bool has_decays(const JointProblem& joint);

/// Fits the runs of `joint` whose motion is not estimated, with the nonlinear effect `id` at work, and leaves what it finds in `joint`. With a strong nonlinearity
/// chi-square has minima everywhere, because a small error of theta grows along the record. So theta and the trajectories are first searched side by side with
/// laws that are trusted more and more (fit/law_smoother.h), from the present size of the effect (its first parameter), a smaller and a larger one, and from the
/// rig file's values where parameters of the rig have gone astray; from the one that trusts its laws furthest, theta and the linear unknowns c are searched
/// side by side with the model itself. Returns chi-square over the degrees of freedom, at the noise levels themselves.
double fit_decays(JointProblem& joint, const std::string& id);

}  // namespace unrig
