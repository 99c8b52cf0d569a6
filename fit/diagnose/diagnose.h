#pragma once
#include <array>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/rig/rig.h"
#include "core/run/run.h"
#include "core/model/wagner.h"
#include "fit/diagnose/maps.h"
#include "fit/diagnose/mismatch.h"
#include "fit/laws/found_law.h"
#include "fit/force/missing_force.h"
#include "fit/diagnose/separating.h"
#include "fit/fit.h"

namespace unrig {

/// What `unrig diagnose` and `unrig trial` allow a search where nothing else is asked [1e9 multiplications], and `unrig diagnose` above it [s of the processor].
constexpr double usual_work = 400, usual_seconds = 60;

/// Why the best set of effects is named or not.
enum class Naming { named, removes_too_little, only_signals, does_not_predict };

/// What a simulated campaign hides, for `unrig trial`.
struct HiddenLaw {
  std::shared_ptr<const Effect> law;
  std::map<std::string, double> truth;  ///< parameters by name, the rig's and the law's
};

/// What an exact model of the truth comes to, fitted from the truth; it has no part in the verdict.
struct AgainstTruth {
  double reduced_chi2 = 0;
  std::vector<double> heldout;  ///< r.m.s. left of DiagnoseProblem::heldout, of the first fitted channel
  std::vector<std::pair<std::vector<std::string>, double>> behind;  ///< sets that were tried, and by how much their twice the log likelihood is below that of the truth
};

/// Where do these recordings and the model of their rig differ, and which physics was left out?
struct DiagnoseProblem {
  Rig rig;
  std::vector<Run> runs;
  std::vector<Run> heldout;           ///< not fitted; predicted, with their own motion, initial state and lift slope
  Wagner circulation = Wagner::within_1e4;
  bool verdict_only = false;          ///< neither maps nor predictions, nor the missing force, and of the fits that with what was found alone
  std::vector<std::string> effects;   ///< candidates; empty: all that can act in these runs
  bool laws = true;                   ///< where no effect explains the runs and no candidates are named, their law is looked for (fit/laws/law_search.h)
  double work = 0;                    ///< counted work after which the search ends with what it has found [1e9 multiplications, core/numerics/work.h]; 0: any
  double limit = 0;                   ///< the same of processor time [s], which depends on the machine; 0: any
  std::optional<HiddenLaw> hidden;    ///< of a trial: all that is tried is held against it
  std::function<void(const std::string&)> progress;
};

/// How the search for the best fit with a set of effects ended. A set with one effect more can do all that the set without it does. Where it leaves a decisively lower likelihood all the same
/// (-2 ln L higher by more than 10), the search has failed, and what the set would explain is not known. `ruled_out`: free decays speak against it, so that the other runs were not searched.
enum class SearchOutcome { complete, ruled_out, failed };

/// A set of effects that was tried.
struct Candidate {
  std::vector<std::string> effects;
  double reduced_chi2 = 0;   ///< of the fitted runs, after the fit
  double delta_bic = 0;      ///< against the fit with nothing missing; negative is better
  double probability = 0;    ///< exp(-BIC/2) over the sum of it over all sets tried; 0 of one of lower BIC than what is named, which leaves something or predicts worse
  double score = 0;          ///< share of what a step without the last effect leaves, that one with it promised to remove (first round only); of the rig's description of the excess of chi-square
  SearchOutcome search = SearchOutcome::complete;
};

struct MissingEffect {
  std::string effect;
  double probability = 0;  ///< that it is missing: over the sets tried, times how often such a verdict is right (share_of_right); of one that is not named over the sets tried
  std::string equation, source;
  std::vector<FittedParameter> parameters;
  std::string advice = {};  ///< what to do about it; of the rig's description only
  std::string kind = {};    ///< Effect::kind; empty of the rig's description
  std::optional<FoundLaw> law = {};  ///< of an effect on no list
};

/// What is missing is an exact rig file or head of a run: no effect, so that core/effects does not know it. Its parameters are the numbers that moved most, `start` what the file says of them.
constexpr const char* rig_description_id = "rig-description";

/// A channel of a run before and after the effects that were found, before: what `Diagnosis::before` leaves. Of a run that was not fitted its first fitted channel; before: predicted by a fit with runs that it cannot
/// explain weighted down.
struct ImprovedRun {
  std::string file, channel, unit;
  bool heldout = false;   ///< not fitted but predicted
  bool left_out = false;  ///< predicted from the other runs, where no run was held out; it has an entry as a fitted run too
  double rms_before = 0, rms_after = 0, noise = 0;
  bool aside = false;  ///< had no part in the fit after (FittedRun::aside): the laws that it is judged by are trusted to within some per cent only
};

/// Effects that may be at work together and explain the runs, and with which probability (fit/diagnose/reliability.h).
struct StatedExplanation {
  std::vector<std::string> effects;  ///< none: nothing is missing
  double probability = 0;
};
constexpr double explanations_hold = 0.95;  ///< probability that Diagnosis::explanations hold the truth
constexpr const char* something_else = "something-else";  ///< the explanation that is none of the sets tried: on no list, or not followed

struct Diagnosis {
  Mismatch mismatch;                   ///< of the best fit with nothing missing
  std::vector<MissingEffect> missing;  ///< the winner
  std::vector<StatedExplanation> explanations;  ///< the fewest that hold the truth with `explanations_hold`, the most probable first
  std::vector<std::vector<std::string>> equivalent;  ///< sets that these runs cannot tell from the winner
  std::vector<std::optional<SeparatingRecording>> separated_by;  ///< and the recording that would, for each of them
  bool unexplained = false;            ///< a significant mismatch remains
  SearchOutcome search = SearchOutcome::complete;    ///< of all; failed: something is unexplained, and it may be because of what was not followed
  std::vector<std::vector<std::string>> not_followed;  ///< then: the sets whose own search failed; an empty set: the rig with nothing added
  std::vector<MissingEffect> closest;  ///< where nothing is named: the best set that was tried
  double removed_by_closest = 0;       ///< share of the excess
  Naming naming = Naming::named;       ///< and why it is not named
  Mismatch remaining;                  ///< and where it sits
  double bic_before = 0, bic_after = 0;
  std::vector<ImprovedRun> runs;
  std::vector<ResidualMaps> maps;      ///< of what the best fit with nothing missing leaves, per fitted run
  std::vector<Candidate> ranking;
  FitResult before;   ///< with nothing missing, all runs at their full weight, as `unrig fit` has it
  FitResult after;
  std::vector<std::shared_ptr<const Effect>> laws;  ///< that are at work in `after`
  std::optional<AgainstTruth> truth;  ///< of a trial
  std::vector<MissingForce> missing_force;  ///< where something is unexplained: what would explain it
  bool stopped = false;  ///< by a limit: sets that were not tried may explain more
  double work = 0;       ///< that the search did [1e9 multiplications]
  double seconds = 0;
};

/// 1. The best fit with nothing missing, runs that it cannot explain weighted down; its residual is tested for energy, colour and a single line.
///    Where it differs from noise and no number states an uncertainty, the rig's description is the first candidate (fit/diagnose/rig_description.h). Numbers that state one are parameters of this fit and of all
///    others, known to what is stated (fit/givens/number_parameters.h).
/// 2. Every candidate is linearised there: how much of the residual could one step in its parameters and the rig's remove?
/// 3. The promising ones are fitted in full, everything free, while the weights return to those of the noise. They are compared by BIC with each run's
///    own variance and with as many samples as the remaining colour leaves independent.
/// 4. While a mismatch remains a further effect is tried beside the best; an effect that others made superfluous is taken away again.
/// 5. Where the rig's description leaves nothing, effects are named only if their evidence beats it decisively. Where it leaves something and effects do so too, effects are tried beside it.
/// 6. Laws, of the list and of no list, are looked for (fit/laws/law_search.h) before step 2 where one of them promises most of all effects, and otherwise where something remains all the same, from the fit with nothing
///    missing, else beside the best set.
/// An effect is named only where no significant mismatch remains beside the set it belongs to, or nearly all of the excess is gone (which is not enough for signals
/// with amplitudes of their own in every run), and where runs that were not fitted are predicted no worse with it than without, but for chance: those held out or, where there
/// are none, each fitted run from the others. Otherwise the mismatch is unexplained, and the force is given that would explain it.
///
/// Limits end the search, not the description of what it found. With a limit of work alone the answer does not depend on the machine's speed. One diagnosis at a time has a limit of time: processor time is the process's
/// (core/numerics/time_limit.h).
///
/// No digit of it depends on the order of the runs (fit/likelihood/run_order.h).
/// Throws InputError where a run does not belong to the rig.
Diagnosis diagnose(const DiagnoseProblem& problem);

}  // namespace unrig
