#pragma once
#include <optional>
#include <vector>

#include "fit/diagnose/explanation.h"
#include "fit/diagnose/selection.h"
#include "fit/laws/law_search.h"

namespace unrig {

/// What a search for laws came to.
struct Laws {
  std::vector<Trial> tried;  ///< the best first, which is what was found
  std::vector<Rival> rivals;
};

/// Whether the runs determine no parameter of some member, not even to within its own size: what they then say is that something acts, not by which equation.
bool is_undetermined(const FitProblem& problem, const Trial& set);

/// Whether none of these leaves nothing that is significant.
bool none_leaves_nothing(const std::vector<Trial>& tried);

/// Sets with laws that were fitted in full, the best first.
struct LawsTried {
  std::vector<Trial> tried;
  bool forms = false;  ///< those of the dictionary were asked
};
/// Laws beside `base`, which the ranking gets. `is_no_law`: whether what a set leaves is explained without any other law. What is `known` but for effects beside nothing, which the selection has screened.
LawsTried search_laws(FitProblem& fit_problem, const Trial& baseline, const Trial& base, LawSearch::Among among, const LawSearch::Asked& is_no_law, Selection& selection, LawSearch::Known known);

/// What was tried, in the noise with a colour that `first` of it has by now; the ranking gets that. Without what leaves twice the excess: beyond any evidence.
std::vector<Trial> in_noise_of(const Trial& first, const std::vector<Trial>& tried, const Trial& baseline, Selection& selection);

/// The law of what no effect explains: beside nothing, since an effect of the list may stand in for it, and beside the best set. A law that is on the list goes by its id: an effect of the list comes first where
/// no form is decisively better. What leaves nothing comes before the rest: of sets that set decays aside the evidence is that of the other runs. Where the first is named, leaves nothing or is no worse than any
/// set that was tried, and is decisively better than what was `found`, it is in `found`. An equation of which the runs determine nothing is no answer.
std::optional<Laws> choose_law(const DiagnoseProblem& problem, FitProblem& fit_problem, const Setting& files, const Trial& baseline, std::vector<Trial> tried, const Selection& selection, FoundSet& found);

/// Laws among `set`, told as such; the rig keeps only those at work.
void tell_laws(FitProblem& fit_problem, const Laws& laws, const FoundSet& found, std::vector<MissingEffect>& set, Diagnosis& d);

}  // namespace unrig
