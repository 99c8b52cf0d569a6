#pragma once
#include <cmath>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "core/files/provenance.h"
#include "core/rig/rig.h"
#include "core/run/run.h"
#include "fit/trial/law_outcome.h"
#include "fit/trial/shard.h"

namespace unrig {

/// How well does `diagnose` find what is missing, with this rig and this noise?
struct TrialProblem {
  Rig rig;
  std::vector<std::string> effects;  ///< hidden in turn, and the candidates of the diagnosis; empty: all
  int trials = 20;
  bool pairs = false;                ///< hide two effects at a time
  bool nulls = false;                ///< hide nothing, in no campaign: how often is something named that is not there?
  bool outside = false;              ///< what is hidden is not among the candidates, or no law that the dictionary can say: nothing should be named, or a curve
  bool laws = false;                 ///< hide a law in every campaign (fit/trial/hidden_law.h), which a full diagnosis with two further runs held out looks for; no `effects`
  bool ideal = false;                ///< white noise, exact files and steady signals instead of what a laboratory adds (fit/trial/laboratory.h)
  double work = usual_work;          ///< of each diagnosis at most (DiagnoseProblem::work); none is stopped by time
  unsigned seed = 1;
  std::vector<Run> recordings;       ///< whose conditions, motion, sampling and noise the simulated runs repeat; none: runs are drawn
  std::optional<double> noise;       ///< of the gauge [N]; without it that of the recordings, or 0.03; of laws 0.03 to 0.3, drawn
  std::size_t shard = 1, shards = 1; ///< only the trials i with i mod shards = shard - 1
  HandOut hand_out;                  ///< if it is set: which trials it says, one after the other
  std::string cases;                 ///< folder in which every trial's outcome is kept and found again; empty: none
  std::function<void(const std::string&)> progress;  ///< called from one thread at a time
};

/// What a diagnosis says of a parameter that all runs share, of an effect that it named and that was hidden.
struct NamedParameter {
  std::string name;
  double truth = 0, value = 0, std_error = 0;

  double deviation() const { return std::abs(value - truth) / std_error; }
};

/// One campaign and what became of it.
struct TrialOutcome {
  std::size_t trial = 0;  ///< i of run_trials
  std::vector<std::string> hidden, found;
  std::vector<std::vector<std::string>> equivalent;  ///< sets that the diagnosis cannot tell from what it found
  std::vector<double> parameters;
  double size = 0;             ///< largest r.m.s. of a run that the hidden effects make, over the noise
  std::vector<double> sizes;   ///< of each hidden effect by itself, in the order of `hidden`
  std::string noise;           ///< kind of the gauge's noise
  std::string misread;         ///< group of the numbers by which the files are off (Laboratory::misread); empty: none
  std::optional<double> probability;  ///< that the diagnosis gives what it found; none where nothing is named
  std::vector<std::vector<std::string>> explanations;  ///< effects of Diagnosis::explanations
  std::vector<NamedParameter> named;  ///< those with a standard error whose truth does not lie on a bound, where no interval has two sides
  bool mismatch = false, unexplained = false;
  std::optional<LawOutcome> law;  ///< of a campaign with a law
  double seconds = 0, work = 0;  ///< that the diagnosis took, and Diagnosis::work
  bool stopped = false;          ///< Diagnosis::stopped
  std::string failure;         ///< what the diagnosis threw, if it did

  bool may_name_description() const;  ///< files are misread, and do not state it
  bool right() const;          ///< exactly what was hidden was found; beside it the rig's description, where it may be
  bool false_name() const;     ///< something was found that was not there
  bool held() const;           ///< what was hidden is among the explanations, or something else is
};

/// How often one effect was found.
struct EffectScore {
  int hidden = 0, found = 0, equivalent = 0;  ///< `equivalent`: not named, but among the sets that the diagnosis calls as good
  double smallest_found = 0;      ///< smallest size that was found
  double nine_in_ten = 0;         ///< least size from which on nine in ten were found; 0: there is none
};

/// Do stated probabilities hold? Over the campaigns in which something was named.
struct Reliability {
  struct Bin {
    double from = 0, to = 1;
    int campaigns = 0, right = 0;
    double stated = 0;  ///< mean probability
  };
  std::vector<Bin> bins;         ///< with campaigns in them
  int campaigns = 0;
  double calibration_error = 0;  ///< mean over campaigns of how far a bin's share of right names is from the mean probability in it
  double brier = 0;              ///< mean square of probability less 1 for a right, 0 for a wrong name
  int explained = 0, held = 0;   ///< campaigns that were diagnosed, and those of them of which the explanations hold the truth
  double members = 0;            ///< explanations on the mean
  int parameters = 0, within_68 = 0, within_95 = 0;  ///< TrialOutcome::named of all campaigns, and how many of their intervals of 68 and 95 % hold the truth
};

struct TrialResult {
  std::vector<TrialOutcome> outcomes;  ///< in the order of the trials
  std::vector<std::string> effects;    ///< hidden in turn
  int trials = 0;                      ///< of all shards together
  std::size_t shard = 1, shards = 1;
  std::string study;                   ///< fingerprint of all that the outcomes depend on (study_of)
  std::map<std::string, std::map<std::string, int>> confusion;  ///< hidden set -> found set -> trials
  std::map<std::string, EffectScore> scores;
  int nulls = 0, false_alarms = 0;    ///< campaigns with nothing hidden, and those of them where something was named
  int wrong_names = 0, misses = 0;    ///< with something hidden: an effect was named that was not there; nothing was named
  Reliability reliability;
  std::optional<LawCounts> laws;      ///< of a trial of laws
  int failures = 0;                   ///< campaigns that could not be drawn or diagnosed: in none of these counts
  unsigned seed = 0;
  std::vector<std::string> recordings;  ///< files that the simulated runs repeat
  std::string rig_file, rig_fingerprint;          ///< core/rig/fingerprint.h
  std::vector<std::string> recording_fingerprints;
  double noise = 0;                     ///< of the gauge [N]; of several recordings or noises that are drawn the largest
};

/// Trial i of laws hides the next of them. Else trial i hides nothing (i = 0 and every further round), or the next of `effects`, or it and another one; sizes and rigs are drawn anew from (seed, i), so
/// that a trial depends on nothing but these two numbers.
///
/// Throws InputError where the rig cannot be plucked and pitched (trial_campaign.h), a recording cannot be repeated (trial_plan.h), or `outside` would leave no candidate.
TrialResult run_trials(const TrialProblem& problem);

/// The counts of `result.outcomes`.
void tally(TrialResult& result);

/// "nothing", or the names with " + " between them, in alphabetical order.
std::string name_of(std::vector<std::string> effects);

}  // namespace unrig
