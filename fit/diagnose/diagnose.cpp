#include "fit/diagnose/diagnose.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <iterator>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "core/effects/effect.h"
#include "core/in_parallel.h"
#include "fit/decays_first.h"
#include "fit/diagnose/heldout.h"
#include "fit/effect_search.h"
#include "fit/fit_description.h"

namespace unrig {
namespace {

using Eigen::Index;
using Strings = std::vector<std::string>;
using Progress = std::function<void(const std::string&)>;

constexpr double half = 0.5;           // of the excess, where decays decide: the search leaves something of the other runs even when it has found what is missing
constexpr double nearly_explained = 10, twice_the_noise = 2;
constexpr double hardly_less = 0.9;    // of the excess: an effect that leaves so much of it is not what is missing
constexpr double decisive = 10;        // BIC: very strong evidence (Kass and Raftery 1995)
constexpr std::size_t most_refits = 5, most_effects = 3, most_in_full = 2;
constexpr std::size_t few = 7;  // candidates that are all worth a fit

/// Effects that can act in at least one of the runs of this rig, are not at work yet, and not `hopeless`.
Strings candidates(const DiagnoseProblem& problem, const JointProblem& joint, const Strings& at_work, const Strings& hopeless) {
  Strings ids;
  for (const Effect& e : effects()) {
    if (!problem.effects.empty() && std::find(problem.effects.begin(), problem.effects.end(), e.id) == problem.effects.end()) continue;
    if (std::find(at_work.begin(), at_work.end(), e.id) != at_work.end()) continue;
    if (std::find(hopeless.begin(), hopeless.end(), e.id) != hopeless.end()) continue;
    if (!has(problem.rig, e.needs)) continue;
    if (e.id == "higher-mode" && problem.rig.normal.modes == 0) continue;  // the model has them all
    if (std::any_of(joint.runs().begin(), joint.runs().end(), [&](const RunResidual& run) { return e.acts(run.conditions()); })) ids.push_back(e.id);
  }
  return ids;
}

/// Some trials, the best first once they are fitted.
using Trials = std::vector<Trial>;

/// A few rounds for all, the rest for those that are ahead.
void fit_linear(Trials& trials) {
  in_parallel(trials.size(), [&](std::size_t i) { fit_fully(trials[i], 2); });
  std::sort(trials.begin(), trials.end(), [](const Trial& a, const Trial& b) { return a.reduced_chi2() < b.reduced_chi2(); });
  in_parallel(std::min(trials.size(), most_in_full), [&](std::size_t i) { fit_fully(trials[i], 6); });
}

/// By the free decays first, the most promising effect first; none after one that leaves nothing of a mismatch too large for two laws to explain alike.
void fit_nonlinear(const Progress& tell, Trials& trials, const Trial& base) {
  double least = base.reduced_chi2();
  for (std::size_t i = 0; i < trials.size(); ++i) {
    Trial& trial = trials[i];
    tell(fmt::format("trying {}", fmt::join(trial.effects, " with ")));
    follow_nonlinear(trial, base, least);
    least = std::min(least, trial.reduced_chi2());
    if (!leaves_nothing(trial) || base.reduced_chi2() < nearly_explained) continue;
    trials.erase(trials.begin() + static_cast<std::ptrdiff_t>(i) + 1, trials.end());
  }
  std::sort(trials.begin(), trials.end(), [](const Trial& a, const Trial& b) { return a.reduced_chi2() < b.reduced_chi2(); });
}

/// What has come to rest at a limit of what its parameters may be, other than zero, and leaves something stands in for something else.
bool plausible(const Trial& trial) {
  const JointProblem& joint = trial.arrival.joint;
  return leaves_nothing(trial) || std::none_of(joint.unknowns().begin(), joint.unknowns().end(), [&](const Unknown& u) {
    const Parameter& p = joint.parameter(u);
    const auto at = [&](double bound) { return bound != 0 && std::abs(u.value - bound) < 1e-6 * std::abs(bound); };
    return !u.held && p.name.starts_with(trial.effects.back() + ".") && (at(p.lower) || at(p.upper));
  });
}

bool any_leaves_nothing(const Trials& trials) { return std::any_of(trials.begin(), trials.end(), leaves_nothing); }

/// All over again for those ahead, and for effects whose own fit has nothing to search in.
void fit_anew(const FitProblem& problem, Trials& trials) {
  in_parallel(trials.size(), [&](std::size_t i) {
    if (decays_decide(trials[i])) return;
    if (i < most_in_full || effect(trials[i].effects.back()).parameters.empty()) fit_from_first_guesses(problem, trials[i]);
  });
}

/// And for the others: among fits that all are far from the data, which is ahead says little.
void fit_others_anew(const FitProblem& problem, Trials& trials) {
  if (trials.size() <= most_in_full) return;
  in_parallel(trials.size() - most_in_full, [&](std::size_t i) {
    Trial& trial = trials[most_in_full + i];
    if (!effect(trial.effects.back()).parameters.empty()) fit_from_first_guesses(problem, trial);
  });
}

/// The best of all sets that have one effect more than `base`: all of them by one linear step, the promising ones in full.
Trials try_one_more(const DiagnoseProblem& problem, const FitProblem& fit_problem, const Trial& base, const Strings& hopeless, const Progress& tell) {
  const Strings ids = candidates(problem, base.arrival.joint, base.effects, hopeless);
  std::vector<std::unique_ptr<Trial>> prepared(ids.size());
  in_parallel(ids.size(), [&](std::size_t i) {
    Strings set = base.effects;
    set.push_back(ids[i]);
    prepared[i] = std::make_unique<Trial>(prepare(fit_problem, base, set));
  });
  std::sort(prepared.begin(), prepared.end(), [](const auto& a, const auto& b) { return a->score > b->score; });
  const double best_score = prepared.empty() ? 0 : prepared.front()->score;
  Trials linear, others, unpromising;
  for (const auto& trial : prepared) {
    const bool promises_nothing = effect(trial->effects.back()).parameters.empty();  // it may hold all the same
    const bool follows_law = nonlinear(*trial), far = base.reduced_chi2() > twice_the_noise;
    const bool promises = linear.size() + others.size() < most_refits && (trial->score > 0.25 * best_score || (follows_law && far));
    const bool step_says_nothing = far && brings_a_law(*trial);  // a law far from the truth
    if (prepared.size() <= few || promises_nothing || promises || step_says_nothing) (follows_law ? others : linear).push_back(std::move(*trial));
    else if (unpromising.size() < most_in_full && !follows_law) unpromising.push_back(std::move(*trial));
  }
  // Linear effects first, which are an order faster; nonlinear ones where none of those leaves nothing or they promise as much.
  constexpr double clearly = 0.8;
  const bool favours_linear = others.empty() || (!linear.empty() && clearly * linear.front().score >= others.front().score);
  fit_linear(linear);
  bool done = any_leaves_nothing(linear);
  if (favours_linear && !done) {
    fit_anew(fit_problem, linear);
    done = any_leaves_nothing(linear);
  }
  if (!done || !favours_linear) {  // a decaying tone may leave nothing of what a weak drag does, and explain it worse
    fit_nonlinear(tell, others, base);
    done = done || any_leaves_nothing(others);
    if (!done && !favours_linear) fit_anew(fit_problem, linear);
    const bool decays_have_told = has_decays(base.arrival.joint);  // from first guesses nonlinear laws are not found where their decays do not lead
    if (!done && !decays_have_told && !any_leaves_nothing(linear)) fit_anew(fit_problem, others);
    if (!done && !any_leaves_nothing(linear) && !any_leaves_nothing(others) && base.effects.empty() && base.reduced_chi2() > nearly_explained) fit_others_anew(fit_problem, linear);
    std::move(others.begin(), others.end(), std::back_inserter(linear));
    if (!any_leaves_nothing(linear)) {  // far from the truth one linear step promises little of what there is
      fit_anew(fit_problem, unpromising);
      std::move(unpromising.begin(), unpromising.end(), std::back_inserter(linear));
    }
  }
  std::sort(linear.begin(), linear.end(), [](const Trial& a, const Trial& b) { return bic_difference(a, b) < 0; });
  std::stable_partition(linear.begin(), linear.end(), plausible);
  return linear;
}

/// Takes away again what the others made superfluous; the last one too: by way of it the others may have come to a minimum that they had missed.
Trial without_superfluous(const FitProblem& fit_problem, Trial trial) {
  for (std::size_t k = 0; trial.effects.size() > 1 && k < trial.effects.size();) {
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

/// Residual power above the noise, over the noise; a run that is left with less than its noise makes up for no other.
double excess(const Trial& trial) {
  double power = 0, count = 0;
  for (std::size_t r = 0; r < trial.variance.size(); ++r) {
    const auto n = static_cast<double>(trial.arrival.joint.runs()[r].run().samples());
    power += n * std::max(0.0, trial.variance[r] - 1);
    count += n;
  }
  return power / count;
}

/// Whether decays that decide are followed, to the noise or in nearly all that they had above it.
bool follows_decays(const Trial& trial, const Trial& baseline) {
  if (!decays_decide(trial) || excess(trial) > half * excess(baseline)) return false;
  const bool nearly = trial.decays.exactly && left_of_decays(trial) - 1 < (1 - enough_to_name) * (left_of_decays(baseline) - 1);
  return trial.decays.chi2 < explained || nearly;
}

/// `best` has effects; `clean`: beside them no significant mismatch remains.
Naming naming_of(const Trial& best, const Trial& baseline, bool clean, bool predicts) {
  if (!predicts) return Naming::does_not_predict;
  if (clean || follows_decays(best, baseline)) return Naming::named;
  if (excess(best) > (1 - enough_to_name) * excess(baseline)) return Naming::removes_too_little;
  return only_signals(best) ? Naming::only_signals : Naming::named;
}

/// exp(-BIC/2) over the sum of it over all.
void give_probabilities(std::vector<Candidate>& ranking) {
  double least = 0, sum = 0;
  for (const Candidate& c : ranking) least = std::min(least, c.delta_bic);
  for (Candidate& c : ranking) sum += c.probability = std::exp(-0.5 * (c.delta_bic - least));
  for (Candidate& c : ranking) c.probability /= sum;
}

/// What runs that were not fitted are left with, before and after.
std::vector<ImprovedRun> predict_unseen(const DiagnoseProblem& problem, const FitProblem& fit_problem, const Arrival& baseline, const Trial& best) {
  FitProblem after = fit_problem;
  after.effects = best.effects;
  const bool leave_out = problem.heldout.empty() && problem.runs.size() > 1 && !best.effects.empty();
  std::vector<ImprovedRun> unseen(leave_out ? problem.runs.size() : problem.heldout.size());
  in_parallel(unseen.size(), [&](std::size_t i) {
    const Run& run = leave_out ? problem.runs[i] : problem.heldout[i];
    const HeldoutResidual b = leave_out ? predict_left_out(baseline, fit_problem, i) : predict_heldout(baseline, fit_problem, run);
    const HeldoutResidual a = leave_out ? predict_left_out(best.arrival, after, i) : predict_heldout(best.arrival, after, run);
    unseen[i] = {run.file, b.channel, run.channel(b.channel).unit, true, leave_out, b.rms, a.rms, a.noise};
  });
  return unseen;
}

double power_over_noise(const std::vector<ImprovedRun>& runs, double ImprovedRun::* rms) {
  double sum = 0;
  for (const ImprovedRun& run : runs) sum += std::pow(run.*rms / run.noise, 2);
  return sum;
}

/// Both fits in full, and what they leave of the fitted runs.
void describe(const DiagnoseProblem& problem, const FitProblem& fit_problem, const Trial& baseline, const Trial& best, Diagnosis& d) {
  FitProblem after = fit_problem;
  after.effects = best.effects;
  Arrival before_arrival = baseline.arrival, after_arrival = best.arrival;
  d.before = describe_fit(before_arrival, fit_problem, d.mismatch.found ? Settle::nothing : Settle::noise);  // a fit that explains nothing deserves no refinement
  d.after = best.effects.empty() ? d.before : describe_fit(after_arrival, after, best.reduced_chi2() < twice_the_noise ? Settle::noise : Settle::nothing);
  d.bic_after = bic_difference(best, baseline) + (d.bic_before = d.before.bic());
  for (std::size_t r = 0; r < problem.runs.size(); ++r) {
    for (std::size_t c = 0; c < d.before.runs[r].channels.size(); ++c) {
      const FittedChannel &b = d.before.runs[r].channels[c], &a = d.after.runs[r].channels[c];
      if (b.name == "alpha") continue;
      d.runs.push_back({problem.runs[r].file, b.name, b.unit, false, false, b.rms_residual, a.rms_residual, std::min(a.noise, b.noise)});
    }
  }
}

/// Whether the search has taken the size of an effect (its first parameter) to zero: another one does its work.
bool is_idle(const JointProblem& joint, const std::string& id) {
  for (const Unknown& u : joint.unknowns())
    if (joint.parameter(u).name.starts_with(id + ".")) return u.value == 0;
  return false;
}

/// The effects of the best set, with their parameters.
std::vector<MissingEffect> effects_of(const Trial& best, const Diagnosis& d) {
  std::vector<MissingEffect> set;
  for (const std::string& id : best.effects) {
    if (is_idle(best.arrival.joint, id)) continue;
    const Effect& e = effect(id);
    MissingEffect m{id, 0, e.equation, e.source, {}};
    for (const Candidate& c : d.ranking)
      if (std::find(c.effects.begin(), c.effects.end(), id) != c.effects.end()) m.probability += c.probability;
    for (const FittedParameter& p : d.after.parameters)
      if (p.name.starts_with(id + ".")) m.parameters.push_back(p);
    set.push_back(m);
  }
  return set;
}

/// The sets of `tried` that are as good as the best.
void name_equivalent(const Trial& baseline, const Trial& best, const Trials& tried, bool verdict_only, Diagnosis& d) {
  const double best_bic = bic_difference(best, baseline);
  for (const Trial& t : tried) {
    const bool other = t.effects != best.effects && t.effects.size() <= best.effects.size();
    if (!other || bic_difference(t, baseline) - best_bic >= decisive) continue;
    d.equivalent.push_back(t.effects);
    d.separated_by.push_back(verdict_only ? std::nullopt : separating_recording(best.arrival, t.arrival));
  }
}

}  // namespace

Diagnosis diagnose(const DiagnoseProblem& problem) {
  const auto begin = std::chrono::steady_clock::now();
  const Progress tell = [&](const std::string& what) {
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
  if (!problem.verdict_only) d.maps = residual_maps(baseline.arrival.joint, d.mismatch.runs);
  d.ranking.push_back({{}, baseline.reduced_chi2(), 0, 0, 0});

  Trial best = baseline;
  Trials all_tried;
  Strings hopeless;  // laws with which alone the fit is worse than without
  while (best.effects.size() < most_effects && !decays_decide(best) && (best.effects.empty() ? d.mismatch.found : best.reduced_chi2() > explained && locate_mismatch(best.arrival.joint).found)) {
    tell(best.effects.empty() ? "trying what may be missing" : "trying what may be missing beside " + best.effects.back());
    Trials tried = try_one_more(problem, fit_problem, best, hopeless, tell);
    for (const Trial& t : tried) d.ranking.push_back({t.effects, t.reduced_chi2(), bic_difference(t, baseline), 0, best.effects.empty() ? t.score : 0});
    for (const Trial& t : tried)
      if (best.effects.empty() && brings_a_law(t) && bic_difference(t, baseline) > decisive) hopeless.push_back(t.effects.back());
    if (tried.empty() || !(best.effects.empty() || plausible(tried.front())) || bic_difference(tried.front(), best) > -decisive) break;
    if (!leaves_nothing(tried.front()) && excess(tried.front()) > hardly_less * excess(best)) break;
    best = without_superfluous(fit_problem, tried.front());
    std::move(tried.begin(), tried.end(), std::back_inserter(all_tried));
  }
  give_probabilities(d.ranking);
  std::sort(d.ranking.begin(), d.ranking.end(), [](const Candidate& a, const Candidate& b) { return a.delta_bic < b.delta_bic; });

  d.remaining = locate_mismatch(best.arrival.joint);
  const bool clean = !d.remaining.found;
  const std::vector<ImprovedRun> unseen = problem.verdict_only ? std::vector<ImprovedRun>{} : predict_unseen(problem, fit_problem, baseline.arrival, best);
  const bool predicts = best.effects.empty() || power_over_noise(unseen, &ImprovedRun::rms_after) <= power_over_noise(unseen, &ImprovedRun::rms_before);
  d.unexplained = d.mismatch.found && !(clean && predicts);

  if (!problem.verdict_only) {
    tell("describing the result");
    describe(problem, fit_problem, baseline, best, d);
    for (const ImprovedRun& run : unseen) d.runs.push_back(run);
    if (d.unexplained) d.missing_force = missing_forces(best.arrival.joint);
  }
  if (!best.effects.empty()) {
    d.naming = naming_of(best, baseline, clean, predicts);
    if (d.naming == Naming::named) name_equivalent(baseline, best, all_tried, problem.verdict_only, d);
    else d.removed_by_closest = 1 - excess(best) / excess(baseline);
    (d.naming == Naming::named ? d.missing : d.closest) = effects_of(best, d);
  }
  d.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  return d;
}

}  // namespace unrig
