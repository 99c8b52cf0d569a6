#pragma once
#include <string>

#include "fit/joint_problem.h"

namespace unrig {

/// Whether any of the runs is a free decay or is driven by what is measured: its motion is not estimated.
bool has_decays(const JointProblem& joint);

/// Fits the runs of `joint` whose motion is not estimated, with the nonlinear effect `id` at work, and leaves what it finds in `joint`. theta and the linear
/// unknowns c are searched side by side over a record that grows from a few samples: with a strong nonlinearity c has least chi-squares everywhere, and a search
/// that eliminates it at every theta (RunResidual) follows the wrong one. Starts from the present size of the effect (its first parameter), a smaller and a
/// larger one; the one that is best early on goes on, and the others where it nearly explains the decays. Returns chi-square over the degrees of freedom, at the
/// noise levels themselves.
double fit_decays(JointProblem& joint, const std::string& id);

}  // namespace unrig
