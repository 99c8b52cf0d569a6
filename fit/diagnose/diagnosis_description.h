#pragma once
#include <vector>

#include "fit/diagnose/diagnose.h"
#include "fit/diagnose/explanation.h"
#include "fit/diagnose/rig_description.h"
#include "fit/diagnose/search_limits.h"
#include "fit/givens/number_parameters.h"

namespace unrig {

/// `found.fit`: the fit with what was found, in full. Where the numbers of the files are not exact they are fitted beside it, and its standard errors allow for theirs.
void tell_fit(const DiagnoseProblem& problem, const FilesToFit& files, const SearchLimits& limits, FoundSet& found);

/// Both fits in full, and what they leave of the fitted runs. Of an explanation with the rig's description put right beyond what the files state `d.after` is the fit with its laws to the rig as the files have it: no fit is
/// told that belongs to a rig in no file.
void describe(const DiagnoseProblem& problem, const FilesToFit& files, const Trial& baseline, const SearchLimits& limits, FoundSet& e, Diagnosis& d);

/// The effects of the best set, with their parameters.
std::vector<MissingEffect> effects_of(const FoundSet& found, const Rig& rig, const Diagnosis& d);

/// The sets of `tried` that are as good as the best, each once, in whatever order its effects were found.
void tell_equivalent(const FoundSet& found, bool described, const std::vector<Trial>& tried, bool verdict_only, Diagnosis& d);

/// The rig's description among all others, in words and with what it does to the load.
MissingEffect missing_description(const RigDescription& description, const FoundSet& found, const FitProblem& fit_problem, const Diagnosis& d);

}  // namespace unrig
