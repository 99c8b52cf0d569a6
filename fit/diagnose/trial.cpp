#include "fit/diagnose/trial.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <exception>
#include <mutex>
#include <nlohmann/json.hpp>

#include "core/error.h"
#include "core/fingerprint.h"
#include "core/in_parallel.h"
#include "fit/diagnose/diagnose.h"
#include "fit/diagnose/trial_campaign.h"
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

TrialOutcome run_trial(const TrialProblem& problem, const Strings& effects, std::size_t trial) {
  std::mt19937_64 random = random_of(problem.seed, trial);
  TrialOutcome outcome;
  outcome.hidden = hidden_in(effects, trial, problem.pairs, random);
  try {
    const TrialCampaign campaign = draw_campaign(problem.rig, outcome.hidden, plan(problem, random), random);
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

void tally(TrialResult& result, const Strings& effects) {
  for (const TrialOutcome& o : result.outcomes) {
    const std::string found = !o.failure.empty() ? "failed" : o.found.empty() && o.unexplained ? "unexplained" : name_of(o.found);
    ++result.confusion[name_of(o.hidden)][found];
    if (!o.failure.empty()) {
      ++result.failures;
      continue;
    }
    if (o.hidden.empty()) {
      ++result.nulls;
      if (!o.found.empty() || o.unexplained) ++result.false_alarms;
      continue;
    }
    if (o.found.empty()) ++result.misses;
    if (std::any_of(o.found.begin(), o.found.end(), [&](const std::string& id) { return !has(o.hidden, id); })) ++result.wrong_names;
  }
  for (const std::string& id : effects) result.scores[id] = score_of(id, result.outcomes);
}

}  // namespace

bool TrialOutcome::right() const { return failure.empty() && name_of(found) == name_of(hidden); }

bool TrialOutcome::among_equivalent() const {
  return std::any_of(equivalent.begin(), equivalent.end(), [&](const Strings& set) { return name_of(set) == name_of(hidden); });
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
  std::vector<Run> runs;
  for (const PlannedRun& run : planned) {
    runs.push_back(run.fine);
    runs.back().dt *= static_cast<double>(PlannedRun::finer);
  }
  Rig hiding = problem.rig;
  hiding.normal.modes = 1;  // as the rig of a campaign that hides modes
  if (ids.empty()) ids = effects_that_act(hiding, runs);
  else refuse_idle("--effects", ids, hiding, runs);
  if (const std::size_t at_a_time = problem.pairs ? 2 : 1; problem.outside && ids.size() <= at_a_time)
    throw InputError({"--outside", 0}, fmt::format("{} to hide in turn, {} at a time", ids.size(), at_a_time), "wanted candidates beside what is hidden", "Name more of --effects.");
  TrialResult result;
  result.seed = problem.seed;
  for (const PlannedRun& run : planned) result.noise = std::max(result.noise, run.noise);
  result.rig_file = problem.rig.file;
  result.rig_fingerprint = fingerprint(problem.rig);
  for (const Run& run : problem.recordings) {
    result.recordings.push_back(run.file);
    result.recording_fingerprints.push_back(fingerprint(run, problem.rig));
  }
  result.outcomes.resize(static_cast<std::size_t>(problem.trials));
  std::mutex mutex;
  int done = 0;
  in_parallel(result.outcomes.size(), [&](std::size_t i) {
    result.outcomes[i] = run_trial(problem, ids, i);
    const std::lock_guard guard(mutex);
    ++done;
    if (problem.progress) problem.progress(fmt::format("{} of {} trials (seed {})", done, problem.trials, problem.seed));
  });
  tally(result, ids);
  return result;
}

std::string to_json(const TrialResult& r, const Provenance& made) {
  using nlohmann::ordered_json;
  ordered_json trials = ordered_json::array(), scores = ordered_json::array();
  for (const TrialOutcome& o : r.outcomes) {
    ordered_json one = {{"hidden", o.hidden}, {"parameters", o.parameters}, {"size", o.size}, {"sizes", o.sizes}, {"found", o.found}, {"equivalent", o.equivalent}, {"mismatch", o.mismatch},
                        {"unexplained", o.unexplained}, {"right", o.right()}, {"seconds", o.seconds}};
    if (!o.failure.empty()) one["failure"] = o.failure;
    trials.push_back(one);
  }
  for (const auto& [id, s] : r.scores)
    scores.push_back({{"effect", id}, {"hidden", s.hidden}, {"found", s.found}, {"equivalent", s.equivalent},
                      {"smallest_found", s.found > 0 ? ordered_json(s.smallest_found) : ordered_json(nullptr)},
                      {"found_nine_in_ten_from", s.nine_in_ten > 0 ? ordered_json(s.nine_in_ten) : ordered_json(nullptr)}});
  const ordered_json json = {{"unrig", "trial"}, {"program", made.program}, {"command", made.command}, {"rig", r.rig_file}, {"rig_fingerprint", r.rig_fingerprint},
                             {"seed", r.seed}, {"noise", {{"gauge", r.noise}, {"unit", "N"}}}, {"recordings", r.recordings}, {"recording_fingerprints", r.recording_fingerprints}, {"nulls", r.nulls}, {"false_alarms", r.false_alarms},
                             {"wrong_names", r.wrong_names}, {"misses", r.misses}, {"confusion", r.confusion}, {"effects", scores}, {"trials", trials}};
  return json.dump(2) + "\n";
}

std::string report(const TrialResult& r) {
  const std::string like = r.recordings.empty() ? "" : fmt::format(", runs like {}", fmt::join(r.recordings, ", "));
  std::string text = fmt::format("{} trials, seed {}, noise {:.4g} N{}: {} false alarms in {} campaigns with nothing hidden\n", r.outcomes.size(), r.seed, r.noise, like, r.false_alarms, r.nulls);
  text += fmt::format("    of {} with something hidden {} named an effect that was not there, {} named nothing\n", static_cast<int>(r.outcomes.size()) - r.nulls - r.failures, r.wrong_names, r.misses);
  text += "[[Hidden -> found]]\n";
  for (const auto& [hidden, row] : r.confusion)
    for (const auto& [found, count] : row) text += fmt::format("    {:<36} {:<36} {:4}\n", hidden, found, count);
  text += "[[Size: largest r.m.s. of a run over the noise]]\n    effect               found  hidden  as good   least found   nine in ten from\n";
  const auto number = [](double x) { return x > 0 ? fmt::format("{:.3g}", x) : std::string("-"); };
  for (const auto& [id, s] : r.scores) text += fmt::format("    {:<20} {:5} {:7} {:8} {:>13} {:>18}\n", id, s.found, s.hidden, s.equivalent, number(s.smallest_found), number(s.nine_in_ten));
  for (const TrialOutcome& o : r.outcomes)
    if (!o.failure.empty()) text += fmt::format("    failed with {} hidden: {}\n", name_of(o.hidden), o.failure);
  return text;
}

}  // namespace unrig
