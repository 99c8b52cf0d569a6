#include "fit/trial/trial.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <exception>
#include <mutex>
#include <optional>

#include "core/files/error.h"
#include "core/rig/fingerprint.h"
#include "core/numerics/in_parallel.h"
#include "fit/diagnose/diagnose.h"
#include "fit/trial/trial_campaign.h"
#include "fit/trial/trial_files.h"
#include "fit/effect_option.h"

namespace unrig {
namespace {

using Strings = std::vector<std::string>;

bool has(const Strings& set, const std::string& id) { return std::find(set.begin(), set.end(), id) != set.end(); }

std::mt19937_64 random_of(unsigned seed, std::size_t trial) {
  std::seed_seq sequence{seed, static_cast<unsigned>(trial)};
  return std::mt19937_64(sequence);
}

Strings hidden_in(const Strings& effects, std::size_t trial, bool pairs, std::mt19937_64& random) {
  const std::size_t turn = trial % (effects.size() + 1);
  if (turn == 0) return {};
  Strings hidden{effects[turn - 1]};
  if (pairs && effects.size() > 1) {
    const std::size_t step = std::uniform_int_distribution<std::size_t>(1, effects.size() - 1)(random);
    hidden.push_back(effects[(turn - 1 + step) % effects.size()]);
  }
  return hidden;
}

constexpr double usual_noise = 0.03;  // N

std::vector<PlannedRun> plan(const TrialProblem& problem, std::mt19937_64& random) {
  return problem.recordings.empty() ? draw_runs(problem.noise.value_or(usual_noise), random) : runs_like(problem.rig, problem.recordings, problem.noise, random);
}

/// Without readings, in the recorded steps.
std::vector<Run> recorded_runs(const std::vector<PlannedRun>& planned) {
  std::vector<Run> runs;
  for (const PlannedRun& run : planned) {
    runs.push_back(run.fine);
    runs.back().dt *= static_cast<double>(PlannedRun::finer);
  }
  return runs;
}

TrialOutcome run_trial(const TrialProblem& problem, const Strings& effects, std::size_t trial) {
  std::mt19937_64 random = random_of(problem.seed, trial);
  TrialOutcome outcome;
  outcome.trial = trial;
  if (!problem.nulls) outcome.hidden = hidden_in(effects, trial, problem.pairs, random);
  try {
    const std::vector<PlannedRun> planned = plan(problem, random);
    const Laboratory laboratory = problem.ideal ? ideal_laboratory() : draw_laboratory(problem.rig, recorded_runs(planned), random);
    outcome.noise = to_string(laboratory.noise);
    outcome.misread = laboratory.misread;
    const TrialCampaign campaign = draw_campaign(problem.rig, outcome.hidden, planned, laboratory, random);
    outcome.parameters = campaign.parameters;
    outcome.size = campaign.size;
    outcome.sizes = campaign.sizes;
    DiagnoseProblem diagnosis;
    diagnosis.rig = campaign.rig;
    diagnosis.runs = campaign.runs;
    diagnosis.effects = effects;
    diagnosis.verdict_only = true;
    if (problem.outside) std::erase_if(diagnosis.effects, [&](const std::string& id) { return has(outcome.hidden, id); });
    const Diagnosis d = diagnose(diagnosis);
    for (const MissingEffect& m : d.missing) outcome.found.push_back(m.effect);
    outcome.equivalent = d.equivalent;
    outcome.mismatch = d.mismatch.found;
    outcome.unexplained = d.unexplained;
    outcome.seconds = d.seconds;
    for (const Candidate& c : d.ranking)
      if (!outcome.found.empty() && name_of(c.effects) == name_of(outcome.found)) outcome.probability = c.probability;
  } catch (const std::exception& e) {
    outcome.failure = e.what();
  }
  return outcome;
}

/// Of trials that hid `id`.
EffectScore score_of(const std::string& id, const std::vector<TrialOutcome>& outcomes) {
  EffectScore score;
  std::vector<std::pair<double, bool>> by_size;
  for (const TrialOutcome& o : outcomes) {
    const auto place = static_cast<std::size_t>(std::find(o.hidden.begin(), o.hidden.end(), id) - o.hidden.begin());
    if (place == o.hidden.size()) continue;
    ++score.hidden;
    const bool found = has(o.found, id);
    const double size = place < o.sizes.size() ? o.sizes[place] : 0;  // a campaign that failed to be drawn has none
    if (found && (score.found++ == 0 || size < score.smallest_found)) score.smallest_found = size;
    if (!found && std::any_of(o.equivalent.begin(), o.equivalent.end(), [&](const Strings& set) { return has(set, id); })) ++score.equivalent;
    by_size.emplace_back(size, found);
  }
  std::sort(by_size.rbegin(), by_size.rend());
  int there = 0, found = 0;
  for (const auto& [size, was_found] : by_size) {
    ++there;
    found += was_found ? 1 : 0;
    if (was_found && 10 * found >= 9 * there) score.nine_in_ten = size;
  }
  return score;
}

Reliability reliability_of(const std::vector<TrialOutcome>& outcomes) {
  constexpr std::array edges{0.0, 0.5, 0.8, 0.9, 0.95, 0.99, 1.0};
  Reliability all;
  for (std::size_t b = 0; b + 1 < edges.size(); ++b) {
    Reliability::Bin bin{edges[b], edges[b + 1]};
    for (const TrialOutcome& o : outcomes) {
      if (!o.probability || *o.probability < bin.from || (*o.probability >= bin.to && b + 2 < edges.size())) continue;
      ++bin.campaigns;
      bin.right += o.right() ? 1 : 0;
      bin.stated += *o.probability;
      all.brier += std::pow(*o.probability - (o.right() ? 1 : 0), 2);
    }
    if (bin.campaigns == 0) continue;
    all.calibration_error += std::abs(bin.stated - bin.right);
    all.campaigns += bin.campaigns;
    bin.stated /= bin.campaigns;
    all.bins.push_back(bin);
  }
  if (all.campaigns > 0) all.calibration_error /= all.campaigns, all.brier /= all.campaigns;
  return all;
}

}  // namespace

bool TrialOutcome::right() const {
  Strings named = found;
  if (!misread.empty()) std::erase(named, rig_description_id);
  return failure.empty() && name_of(named) == name_of(hidden);
}

bool TrialOutcome::false_name() const {
  return std::any_of(found.begin(), found.end(), [&](const std::string& id) { return !has(hidden, id) && !(id == rig_description_id && !misread.empty()); });
}

bool TrialOutcome::among_equivalent() const {
  return std::any_of(equivalent.begin(), equivalent.end(), [&](const Strings& set) { return name_of(set) == name_of(hidden); });
}

void tally(TrialResult& result) {
  for (const TrialOutcome& o : result.outcomes) {
    const std::string found = !o.failure.empty() ? "failed" : o.found.empty() && o.unexplained ? "unexplained" : name_of(o.found);
    ++result.confusion[name_of(o.hidden)][found];
    if (!o.failure.empty()) {
      ++result.failures;
      continue;
    }
    if (o.hidden.empty()) {
      ++result.nulls;
      if (o.false_name() || o.unexplained) ++result.false_alarms;
      continue;
    }
    if (o.found.empty()) ++result.misses;
    if (o.false_name()) ++result.wrong_names;
  }
  result.reliability = reliability_of(result.outcomes);
  for (const std::string& id : result.effects) result.scores[id] = score_of(id, result.outcomes);
}

std::string name_of(Strings effects) {
  std::sort(effects.begin(), effects.end());
  return effects.empty() ? "nothing" : fmt::format("{}", fmt::join(effects, " + "));
}

TrialResult run_trials(const TrialProblem& problem) {
  check_for_trials(problem.rig);
  Strings ids = problem.effects;
  std::mt19937_64 any;
  const std::vector<PlannedRun> planned = plan(problem, any);
  const std::vector<Run> runs = recorded_runs(planned);
  Rig hiding = problem.rig;
  hiding.normal.modes = 1;  // as the rig of a campaign that hides modes
  if (ids.empty()) ids = effects_that_act(hiding, runs);
  else refuse_idle("--effects", ids, hiding, runs);
  if (const std::size_t at_a_time = problem.pairs ? 2 : 1; problem.outside && ids.size() <= at_a_time)
    throw InputError({"--outside", 0}, fmt::format("{} to hide in turn, {} at a time", ids.size(), at_a_time), "wanted candidates beside what is hidden", "Name more of --effects.");
  TrialResult result;
  result.seed = problem.seed;
  result.effects = ids;
  result.trials = problem.trials;
  result.shard = problem.shard;
  result.shards = problem.shards;
  for (const PlannedRun& run : planned) result.noise = std::max(result.noise, run.noise);
  result.rig_file = problem.rig.file;
  result.rig_fingerprint = fingerprint(problem.rig);
  for (const Run& run : problem.recordings) {
    result.recordings.push_back(run.file);
    result.recording_fingerprints.push_back(fingerprint(run, problem.rig));
  }
  result.study = study_of(problem, ids);
  const TrialCases cases(problem.cases, result.study);
  const auto trials = static_cast<std::size_t>(problem.trials);
  const Pieces pieces = problem.hand_out ? problem.hand_out(trials) : pieces_of_shard(problem.shard, problem.shards, trials);
  std::mutex mutex;
  in_parallel(pieces.most, [&](std::size_t) {
    const std::optional<std::size_t> trial = pieces.next();
    if (!trial) return;
    std::optional<TrialOutcome> outcome = cases.find(*trial);
    if (!outcome) {
      outcome = run_trial(problem, ids, *trial);
      cases.keep(*outcome);
    }
    const std::lock_guard guard(mutex);
    result.outcomes.push_back(std::move(*outcome));
    if (problem.progress) problem.progress(fmt::format("{} of {} trials (seed {})", result.outcomes.size(), pieces.most, problem.seed));
  });
  std::sort(result.outcomes.begin(), result.outcomes.end(), [](const TrialOutcome& a, const TrialOutcome& b) { return a.trial < b.trial; });
  tally(result);
  return result;
}

}  // namespace unrig
