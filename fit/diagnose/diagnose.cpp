#include "fit/diagnose/diagnose.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <thread>

#include "core/effects/effect.h"
#include "fit/diagnose/heldout.h"
#include "fit/diagnose/search.h"
#include "fit/fit_description.h"

namespace unrig {
namespace {

using Eigen::Index;
using Strings = std::vector<std::string>;

constexpr double explained = 1.15;     // residual power over noise power of a model that leaves nothing to name
constexpr double nearly_all = 0.97;    // share of the excess that an effect must remove to be named where something remains
constexpr double nearly_explained = 10;
constexpr double decisive = 10;        // BIC: very strong evidence (Kass and Raftery 1995)
constexpr std::size_t most_refits = 5, most_effects = 3, most_in_full = 2;
constexpr std::size_t few = 7;  // candidates that are all worth a fit

/// Runs `work(0..count)` on so many threads.
template <class Work>
void in_parallel(std::size_t count, int threads, Work work) {
  std::atomic<std::size_t> next{0};
  const auto worker = [&] {
    for (std::size_t i = next++; i < count; i = next++) work(i);
  };
  std::vector<std::thread> others;
  for (int t = 1; t < threads; ++t) others.emplace_back(worker);
  worker();
  for (std::thread& t : others) t.join();
}

/// Effects that can act in at least one of the runs of this rig and are not at work yet.
Strings candidates(const DiagnoseProblem& problem, const JointProblem& joint, const Strings& at_work) {
  Strings ids;
  for (const Effect& e : effects()) {
    if (!problem.effects.empty() && std::find(problem.effects.begin(), problem.effects.end(), e.id) == problem.effects.end()) continue;
    if (std::find(at_work.begin(), at_work.end(), e.id) != at_work.end()) continue;
    if (problem.rig.is_modal() && !e.on_modal_rigs) continue;
    if (e.id == "higher-mode" && problem.rig.normal.modes == 0) continue;  // the model has them all
    if (std::any_of(joint.runs().begin(), joint.runs().end(), [&](const RunResidual& run) { return e.acts(run.conditions()); })) ids.push_back(e.id);
  }
  return ids;
}

bool nonlinear(const Trial& trial) {
  const JointProblem& joint = trial.arrival.joint;
  for (std::size_t r = 0; r < joint.runs().size(); ++r)
    if (joint.runs()[r].largest_arguments(joint.theta(r)).size() > 0) return true;
  return false;
}

bool leaves_nothing(const Trial& trial) { return trial.reduced_chi2() < explained; }

/// Fits the trials [first, last): a few rounds for all, the rest for those that are ahead; from first guesses where none of them leaves nothing.
void fit_those(std::vector<Trial>& trials, std::size_t first, std::size_t last, const DiagnoseProblem& problem, const FitProblem& fit_problem) {
  const auto begin = trials.begin() + static_cast<std::ptrdiff_t>(first), end = trials.begin() + static_cast<std::ptrdiff_t>(last);
  in_parallel(last - first, problem.threads, [&](std::size_t i) { fit_fully(trials[first + i], 2); });
  std::sort(begin, end, [](const Trial& a, const Trial& b) { return a.reduced_chi2() < b.reduced_chi2(); });
  const std::size_t ahead = std::min(last - first, most_in_full);
  in_parallel(ahead, problem.threads, [&](std::size_t i) { fit_fully(trials[first + i], 6); });
  if (std::any_of(begin, end, leaves_nothing)) return;
  in_parallel(last - first, problem.threads, [&](std::size_t i) {
    Trial& trial = trials[first + i];
    if (i < ahead || effect(trial.effects.back()).parameters.empty()) fit_from_first_guesses(fit_problem, trial);
  });
}

/// The best of all sets that have one effect more than `base`: all of them by one linear step, the promising ones in full.
std::vector<Trial> try_one_more(const DiagnoseProblem& problem, const FitProblem& fit_problem, const Trial& base) {
  const Strings ids = candidates(problem, base.arrival.joint, base.effects);
  std::vector<std::unique_ptr<Trial>> prepared(ids.size());
  in_parallel(ids.size(), problem.threads, [&](std::size_t i) {
    Strings set = base.effects;
    set.push_back(ids[i]);
    prepared[i] = std::make_unique<Trial>(prepare(fit_problem, base, set));
  });
  std::sort(prepared.begin(), prepared.end(), [](const auto& a, const auto& b) { return a->score > b->score; });
  const double best_score = prepared.empty() ? 0 : prepared.front()->score;
  std::vector<Trial> promising;
  for (const auto& trial : prepared) {
    const bool promises_nothing = effect(trial->effects.back()).parameters.empty();  // it may hold all the same
    const bool promises = promising.size() < most_refits && trial->score > 0.25 * best_score;
    if (prepared.size() <= few || promises_nothing || promises) promising.push_back(std::move(*trial));
  }
  // Linear effects first, which are an order faster; nonlinear ones where none of those leaves nothing.
  const auto first_nonlinear = std::stable_partition(promising.begin(), promising.end(), [](const Trial& t) { return !nonlinear(t); });
  const auto linear = static_cast<std::size_t>(first_nonlinear - promising.begin());
  fit_those(promising, 0, linear, problem, fit_problem);
  if (std::none_of(promising.begin(), first_nonlinear, leaves_nothing))
    fit_those(promising, linear, promising.size(), problem, fit_problem);
  else
    promising.erase(first_nonlinear, promising.end());
  std::sort(promising.begin(), promising.end(), [](const Trial& a, const Trial& b) { return bic_difference(a, b) < 0; });
  return promising;
}

/// Takes away again what the others made superfluous.
Trial without_superfluous(const FitProblem& fit_problem, Trial trial) {
  for (std::size_t k = 0; trial.effects.size() > 1 && k + 1 < trial.effects.size();) {
    Strings fewer = trial.effects;
    fewer.erase(fewer.begin() + static_cast<std::ptrdiff_t>(k));
    Trial smaller = prepare(fit_problem, trial, fewer);
    fit_fully(smaller, 6);
    if (bic_difference(smaller, trial) < decisive)
      trial = std::move(smaller);
    else
      ++k;
  }
  return trial;
}

double excess(const Trial& trial) { return std::max(0.0, trial.reduced_chi2() - 1); }

/// exp(-BIC/2) over the sum of it over all.
void give_probabilities(std::vector<Candidate>& ranking) {
  double least = 0, sum = 0;
  for (const Candidate& c : ranking) least = std::min(least, c.delta_bic);
  for (Candidate& c : ranking) sum += c.probability = std::exp(-0.5 * (c.delta_bic - least));
  for (Candidate& c : ranking) c.probability /= sum;
}

}  // namespace

Diagnosis diagnose(const DiagnoseProblem& problem) {
  const auto begin = std::chrono::steady_clock::now();
  const auto tell = [&](const std::string& what) {
    if (problem.progress) problem.progress(what);
  };
  FitProblem fit_problem;
  fit_problem.rig = problem.rig;
  fit_problem.runs = problem.runs;
  fit_problem.circulation = problem.circulation;

  tell("fitting the rig with nothing missing");
  const Trial baseline = fit_baseline(fit_problem);
  Diagnosis d;
  d.mismatch = locate_mismatch(baseline.arrival.joint);
  d.ranking.push_back({{}, baseline.reduced_chi2(), 0, 0, 0});

  Trial best = baseline;
  while (best.effects.size() < most_effects && (best.effects.empty() ? d.mismatch.found : best.reduced_chi2() > explained && locate_mismatch(best.arrival.joint).found)) {
    tell(best.effects.empty() ? "trying what may be missing" : "trying what may be missing beside " + best.effects.back());
    const std::vector<Trial> tried = try_one_more(problem, fit_problem, best);
    for (const Trial& t : tried) d.ranking.push_back({t.effects, t.reduced_chi2(), bic_difference(t, baseline), 0, best.effects.empty() ? t.score : 0});
    if (tried.empty() || bic_difference(tried.front(), best) > -decisive) break;
    best = without_superfluous(fit_problem, tried.front());
    if (nonlinear(best) && best.reduced_chi2() > explained && best.reduced_chi2() < nearly_explained) fit_exactly(best);
  }
  give_probabilities(d.ranking);
  std::sort(d.ranking.begin(), d.ranking.end(), [](const Candidate& a, const Candidate& b) { return a.delta_bic < b.delta_bic; });

  d.remaining = locate_mismatch(best.arrival.joint);
  const bool clean = leaves_nothing(best) || !d.remaining.found;
  const bool named = !best.effects.empty() && (clean || excess(best) < (1 - nearly_all) * excess(baseline));
  d.unexplained = d.mismatch.found && !clean;

  tell("describing the result");
  FitProblem after = fit_problem;
  after.effects = best.effects;
  Arrival before_arrival = baseline.arrival, after_arrival = best.arrival;
  d.before = describe_fit(before_arrival, fit_problem);
  d.after = best.effects.empty() ? d.before : describe_fit(after_arrival, after);
  d.bic_after = bic_difference(best, baseline) + (d.bic_before = d.before.bic());
  if (named) {
    for (const std::string& id : best.effects) {
      const Effect& e = effect(id);
      MissingEffect m{id, 0, e.equation, e.source, {}};
      for (const Candidate& c : d.ranking)
        if (std::find(c.effects.begin(), c.effects.end(), id) != c.effects.end()) m.probability += c.probability;
      for (const FittedParameter& p : d.after.parameters)
        if (p.name.starts_with(id + ".")) m.parameters.push_back(p);
      d.missing.push_back(m);
    }
    for (const Candidate& c : d.ranking) {
      const bool same = c.effects == best.effects;
      if (!same && !c.effects.empty() && c.effects.size() <= best.effects.size() && c.delta_bic - bic_difference(best, baseline) < decisive) d.equivalent.push_back(c.effects);
    }
  }
  for (std::size_t r = 0; r < problem.runs.size(); ++r) {
    const FittedChannel &b = d.before.runs[r].channels.front(), &a = d.after.runs[r].channels.front();
    d.runs.push_back({problem.runs[r].file, b.unit, false, b.rms_residual, a.rms_residual, std::min(a.noise, b.noise)});
  }
  for (const Run& run : problem.heldout) {
    const HeldoutResidual b = predict_heldout(baseline.arrival, fit_problem, run), a = predict_heldout(best.arrival, after, run);
    d.runs.push_back({run.file, run.channel(b.channel).unit, true, b.rms, a.rms, a.noise});
  }
  d.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  return d;
}

}  // namespace unrig
