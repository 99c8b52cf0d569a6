#pragma once
#include <string>

#include "fit/joint_problem.h"

namespace unrig {

/// Whether any of the runs is a free decay or is driven by what is measured: its motion is not estimated.
bool has_decays(const JointProblem& joint);

/// Whether following the model takes several steps a sample in any of the runs (freeplay). A trajectory that crosses the corners of a law for seconds tells errors of
/// theta beyond the noise from each other as little as chance does: of such laws is asked what they leave when they are trusted to within some percents.
bool takes_small_steps(const JointProblem& joint);

/// Fits the runs of `joint` whose motion is not estimated, with the nonlinear effect `id` at work, and leaves what it finds in `joint`. With a strong nonlinearity
/// chi-square has minima everywhere, because a small error of theta grows along the record. So theta and the trajectories are first searched side by side with
/// laws that are trusted more and more (fit/law_smoother.h), from the present size of the effect (its first parameter) and from the first values of parameters that
/// have gone astray; from there theta and the linear unknowns c are searched side by side with the model itself. Where that does not follow the decays, once more from
/// a smaller and a larger size. Returns chi-square over the degrees of freedom, at the noise levels themselves. Laws that take small steps are only trusted to within
/// 2.5 % of the force that is missed without them, from whichever size leads furthest; J over the samples is returned, infinite where they are not worth that trust.
double fit_decays(JointProblem& joint, const std::string& id);

}  // namespace unrig
