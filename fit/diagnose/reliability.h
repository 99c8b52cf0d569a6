#pragma once
#include <vector>

#include "fit/diagnose/diagnose.h"

namespace unrig {

/// How often a verdict like this is right: the share of campaigns in which exactly what was named had been hidden, or in which nothing of three times the noise or more had been where nothing is missing, as
/// counted on campaigns of which the truth is known, with noise of all kinds, files that are off and forces that wander (tests/studies/TRIAL.md).
double share_of_right(const Diagnosis& d);

/// The fewest explanations that hold the truth with `explanations_hold`, the most probable first. A set of effects has the probability
///
///   share_of_right exp(-BIC/2) / sum of exp(-BIC/2) over all sets tried,
///
/// the rig with nothing added is the empty set, and the rest is that of `something_else`.
std::vector<StatedExplanation> explanations_of(const Diagnosis& d);

}  // namespace unrig
