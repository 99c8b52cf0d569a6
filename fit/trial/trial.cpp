#include "fit/trial/trial.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <exception>
#include <mutex>
#include <optional>

#include "core/effects/effect.h"
#include "core/files/error.h"
#include "core/law/law_effect.h"
#include "core/rig/fingerprint.h"
#include "core/numerics/in_parallel.h"
#include "fit/diagnose/diagnose.h"
#include "fit/diagnose/reliability.h"
#include "fit/trial/hidden_law.h"
#include "fit/trial/trial_campaign.h"
#include "fit/trial/trial_files.h"
#include "fit/effect_option.h"
#include "fit/uncertainty/profile.h"

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

constexpr double usual_noise = 0.03, loudest_of_laws = 0.3;  // N

std::optional<double> draw_noise_level(const TrialProblem& problem, std::mt19937_64& random) {
  if (problem.noise || !problem.laws || !problem.recordings.empty()) return problem.noise;
  return log_between(random, usual_noise, loudest_of_laws);
}

std::vector<PlannedRun> plan(const TrialProblem& problem, std::optional<double> noise, std::mt19937_64& random) {
  return problem.recordings.empty() ? draw_runs(noise.value_or(usual_noise), random) : runs_like(problem.rig, problem.recordings, noise, random);
}

/// Of a plan drawn anew the last pluck, from a smaller load, and the last step from an attached flow: not to be fitted.
std::vector<PlannedRun> plan_heldout(const TrialProblem& problem, std::optional<double> noise, std::mt19937_64& random) {
  constexpr double attached = 0.2;  // rad
  std::vector<PlannedRun> again = plan(problem, noise, random), heldout;
  for (const bool pluck : {true, false}) {
    const auto is_one = [&](const PlannedRun& run) { return (run.release > 0) == pluck && std::abs(run.fine.channel("alpha").value[0]) < attached; };
    const auto last = std::find_if(again.rbegin(), again.rend(), is_one);
    if (last == again.rend()) continue;
    heldout.push_back(*last);
    PlannedRun& run = heldout.back();
    run.fine.file = "heldout_" + run.fine.file;
    run.fine.name = "heldout " + run.fine.name;
    run.release *= between(random, 0.6, 0.9);
  }
  return heldout;
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

/// A campaign with a law in place of effects: the rig that has it, runs to fit and, behind them, runs to hold out.
struct LawPlan {
  Law law;
  Rig rig;
  std::vector<PlannedRun> runs;
  std::size_t heldout = 0;
  Eigen::VectorXd truth;  // of the rig
};

LawPlan plan_law(const TrialProblem& problem, std::size_t trial, std::mt19937_64& random) {
  LawPlan planned;
  const std::optional<double> noise = draw_noise_level(problem, random);
  planned.runs = plan(problem, noise, random);
  planned.truth = draw_rig(whole_model(problem.rig, planned.runs), random);
  const Reached reached = reached_by(problem.rig, planned.runs, planned.truth);
  const std::vector<Law> forms = laws_to_hide(problem.rig, reached, problem.outside);
  planned.law = draw_law(forms[trial % forms.size()], reached, random);
  planned.rig = problem.rig;
  add_law(planned.rig, planned.law);
  const std::vector<PlannedRun> heldout = plan_heldout(problem, noise, random);
  planned.heldout = heldout.size();
  planned.runs.insert(planned.runs.end(), heldout.begin(), heldout.end());
  return planned;
}

TrialCampaign draw(const TrialProblem& problem, const Rig& rig, const std::vector<PlannedRun>& planned, const std::optional<Eigen::VectorXd>& truth, std::mt19937_64& random, TrialOutcome& outcome) {
  const Laboratory laboratory = problem.ideal ? ideal_laboratory() : draw_laboratory(problem.rig, recorded_runs(planned), random);
  outcome.noise = to_string(laboratory.noise);
  outcome.misread = laboratory.misread;
  TrialCampaign campaign = draw_campaign(rig, outcome.hidden, planned, laboratory, random, truth);
  outcome.parameters = campaign.parameters;
  outcome.size = campaign.size;
  outcome.sizes = campaign.sizes;
  return campaign;
}

void take_verdict(const Diagnosis& d, TrialOutcome& outcome) {
  for (const MissingEffect& m : d.missing) outcome.found.push_back(m.effect);
  outcome.equivalent = d.equivalent;
  outcome.mismatch = d.mismatch.found;
  outcome.unexplained = d.unexplained;
  outcome.seconds = d.seconds;
  outcome.work = d.work;
  outcome.stopped = d.stopped;
  for (const Candidate& c : d.ranking)
    if (!outcome.found.empty() && name_of(c.effects) == name_of(outcome.found)) outcome.probability = share_of_right(d) * c.probability;
  for (const StatedExplanation& e : d.explanations) outcome.explanations.push_back(e.effects);
}

/// Parameters with their intervals of the hidden effects among those that are named.
std::vector<NamedParameter> named_parameters(const Diagnosis& d, const TrialCampaign& campaign, const Rig& rig) {
  std::vector<NamedParameter> named;
  for (const MissingEffect& m : d.missing) {
    if (!has(campaign.hidden, m.effect)) continue;
    const std::vector<Parameter>& own = effect(rig, m.effect).parameters_on(rig);
    for (const FittedParameter& p : m.parameters) {
      const auto truth = campaign.truth.find(p.name);
      if (!p.run.empty() || !p.identified || !(p.std_error > 0) || truth == campaign.truth.end()) continue;
      const Parameter& as_listed = own[static_cast<std::size_t>(p.place)];
      if (truth->second > as_listed.lower && truth->second < as_listed.upper) named.push_back({p.name, truth->second, p.value, p.std_error});
    }
  }
  return named;
}

void try_effects(const TrialProblem& problem, const Strings& effects, std::mt19937_64& random, TrialOutcome& outcome) {
  const TrialCampaign campaign = draw(problem, problem.rig, plan(problem, problem.noise, random), {}, random, outcome);
  DiagnoseProblem diagnosis;
  diagnosis.rig = campaign.rig;
  diagnosis.runs = campaign.runs;
  if (!problem.effects.empty() || problem.outside) diagnosis.effects = effects;
  diagnosis.verdict_only = true;
  diagnosis.work = problem.work;
  if (problem.outside) std::erase_if(diagnosis.effects, [&](const std::string& id) { return has(outcome.hidden, id); });
  const Diagnosis d = diagnose(diagnosis);
  take_verdict(d, outcome);
  outcome.named = named_parameters(d, campaign, problem.rig);
}

void try_law(const TrialProblem& problem, std::mt19937_64& random, TrialOutcome& outcome) {
  const LawPlan planned = plan_law(problem, outcome.trial, random);
  outcome.hidden = {planned.law.id()};
  const TrialCampaign campaign = draw(problem, planned.rig, planned.runs, planned.truth, random, outcome);
  const auto first_heldout = campaign.runs.end() - static_cast<std::ptrdiff_t>(planned.heldout);
  DiagnoseProblem diagnosis;
  diagnosis.rig = campaign.rig;
  diagnosis.rig.laws.clear();
  diagnosis.runs.assign(campaign.runs.begin(), first_heldout);
  diagnosis.heldout.assign(first_heldout, campaign.runs.end());
  diagnosis.work = problem.work;
  diagnosis.hidden = HiddenLaw{planned.rig.laws.back(), campaign.truth};
  const Diagnosis d = diagnose(diagnosis);
  take_verdict(d, outcome);
  outcome.law = judged(planned.law, problem.outside, planned.runs.front().noise, !outcome.misread.empty(), d);
}

TrialOutcome run_trial(const TrialProblem& problem, const Strings& effects, std::size_t trial) {
  std::mt19937_64 random = random_of(problem.seed, trial);
  TrialOutcome outcome;
  outcome.trial = trial;
  if (!problem.nulls && !problem.laws) outcome.hidden = hidden_in(effects, trial, problem.pairs, random);
  try {
    if (problem.laws) try_law(problem, random, outcome);
    else try_effects(problem, effects, random, outcome);
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
  for (const TrialOutcome& o : outcomes) {
    if (o.explanations.empty()) continue;
    ++all.explained;
    all.held += o.held() ? 1 : 0;
    all.members += static_cast<double>(o.explanations.size());
  }
  for (const TrialOutcome& o : outcomes) {
    for (const NamedParameter& p : o.named) {
      ++all.parameters;
      all.within_68 += p.deviation() < 1 ? 1 : 0;
      all.within_95 += p.deviation() < two_sided_quantile(0.95) ? 1 : 0;
    }
  }
  if (all.explained > 0) all.members /= all.explained;
  if (all.campaigns > 0) all.calibration_error /= all.campaigns, all.brier /= all.campaigns;
  return all;
}

}  // namespace

namespace {

/// Whether a set is exactly what was hidden; beside it, where files are misread, the rig's description may be.
bool is_hidden(Strings set, const TrialOutcome& o) {
  if (o.may_name_description()) std::erase(set, rig_description_id);
  return name_of(set) == name_of(o.hidden);
}

}  // namespace

bool TrialOutcome::may_name_description() const { return !misread.empty() && misread != as_stated; }

bool TrialOutcome::right() const { return failure.empty() && is_hidden(found, *this); }

bool TrialOutcome::held() const {
  return std::any_of(explanations.begin(), explanations.end(), [&](const Strings& set) { return set == Strings{something_else} || is_hidden(set, *this); });
}

bool TrialOutcome::false_name() const {
  return std::any_of(found.begin(), found.end(), [&](const std::string& id) { return !has(hidden, id) && !(id == rig_description_id && may_name_description()); });
}

void tally(TrialResult& result) {
  std::vector<const LawOutcome*> laws;
  for (const TrialOutcome& o : result.outcomes)
    if (o.law) laws.push_back(&*o.law);
  if (!laws.empty()) result.laws = count_laws(laws);
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

namespace {

/// Ids of what is hidden in turn in runs like these.
Strings hidden_in_turn(const TrialProblem& problem, const std::vector<PlannedRun>& planned) {
  Strings ids = problem.effects;
  if (problem.laws) {
    for (const Law& law : laws_to_hide(problem.rig, reached_by(problem.rig, planned), problem.outside)) ids.push_back(law.id());
    return ids;
  }
  const std::vector<Run> runs = recorded_runs(planned);
  Rig hiding = problem.rig;
  hiding.normal.modes = 1;  // as the rig of a campaign that hides modes
  if (ids.empty()) ids = effects_that_act(hiding, runs);
  else refuse_idle("--effects", ids, hiding, runs);
  if (const std::size_t at_a_time = problem.pairs ? 2 : 1; problem.outside && ids.size() <= at_a_time)
    throw InputError({"--outside", 0}, fmt::format("{} to hide in turn, {} at a time", ids.size(), at_a_time), "wanted candidates beside what is hidden", "Name more of --effects.");
  return ids;
}

}  // namespace

TrialResult run_trials(const TrialProblem& problem) {
  check_for_trials(problem.rig);
  std::mt19937_64 any;
  const std::vector<PlannedRun> planned = plan(problem, problem.noise, any);
  const Strings ids = hidden_in_turn(problem, planned);
  TrialResult result;
  result.seed = problem.seed;
  result.effects = ids;
  result.trials = problem.trials;
  result.shard = problem.shard;
  result.shards = problem.shards;
  for (const PlannedRun& run : planned) result.noise = std::max(result.noise, run.noise);
  if (problem.laws && !problem.noise && problem.recordings.empty()) result.noise = loudest_of_laws;
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
