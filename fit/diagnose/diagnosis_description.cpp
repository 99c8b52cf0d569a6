#include "fit/diagnose/diagnosis_description.h"

#include <algorithm>
#include <iterator>
#include <set>
#include <utility>

#include <fmt/format.h>

#include "core/effects/effect.h"
#include "core/law/law_effect.h"
#include "fit/fit_description.h"
#include "fit/search/noise_of_trial.h"

namespace unrig {
namespace {

/// The fit with nothing missing and every run at its full weight, from where the baseline stands; `thorough`: or from first guesses and the starts around them, as `unrig fit` searches, where that leaves less. Whether it
/// leaves so much less that the baseline, from which all else was searched, was no place to begin from.
struct PlainFit {
  Arrival arrival;
  bool baseline_was_lost = false;
};
PlainFit plain_fit(const FitProblem& problem, const Arrival& baseline, bool thorough) {
  PlainFit plain{baseline};
  for (RunResidual& run : plain.arrival.joint.runs()) run.temper(1);
  solve(plain.arrival);
  if (!thorough) return plain;
  Arrival anew = arrive(problem, baseline.model);
  const double before = plain.arrival.joint.chi2(), after = anew.joint.chi2();
  plain.baseline_was_lost = after < hardly_less * before;
  if (after < before) plain.arrival = std::move(anew);
  return plain;
}

/// With noise and motions looked at again, where that is worth it and does not take too long; otherwise as the search left it.
FitResult told(const Arrival& found, const FitProblem& problem, Settle settle, const SearchLimits& limits) {
  FitResult fit;
  Arrival looked_at_again = found, as_it_is = found;
  if (settle != Settle::nothing && limits.describe([&] { fit = describe_fit(looked_at_again, problem, settle); })) return fit;
  fit = describe_fit(as_it_is, problem, Settle::nothing);
  if (settle != Settle::nothing) fit.warnings.push_back("what was found is told as the search left it: to look at noise and motions again would have taken too long");
  return fit;
}

/// Whether the search has taken the size of an effect (its first parameter) to zero: another one does its work.
bool is_idle(const JointProblem& joint, const std::string& id) {
  for (const Unknown& u : joint.unknowns())
    if (joint.parameter(u).effect == id) return u.value == 0;
  return false;
}

Settle settled(const Trial& trial) { return trial.reduced_chi2() < twice_the_noise ? Settle::all : Settle::nothing; }

double probability_of(const std::string& id, const std::vector<Candidate>& ranking) {
  double sum = 0;
  for (const Candidate& c : ranking)
    if (std::find(c.effects.begin(), c.effects.end(), id) != c.effects.end()) sum += c.probability;
  return sum;
}

}  // namespace

FitResult fit_with(const FoundSet& found, const SearchLimits& limits) {
  FitProblem after = *found.setting.problem;
  after.effects = found.best.effects;
  return told(found.best.arrival, after, settled(found.best), limits);
}

void describe(const FitProblem& fit_problem, const Trial& baseline, const SearchLimits& limits, FoundSet& e, Diagnosis& d) {
  const Trial& best = e.best;
  const bool described = e.setting.problem != &fit_problem;
  Arrival before_arrival = baseline.arrival;
  if (d.mismatch.found) {
    PlainFit plain = plain_fit(fit_problem, baseline.arrival, d.unexplained && !has_colour(baseline.arrival.joint));  // first guesses know of none
    before_arrival = std::move(plain.arrival);
    if (plain.baseline_was_lost) d.not_followed.insert(d.not_followed.begin(), std::vector<std::string>{});
  }
  d.before = told(before_arrival, fit_problem, d.mismatch.found ? Settle::nothing : Settle::all, limits);  // a fit that explains nothing deserves no refinement
  e.fit = best.effects.empty() && !described ? d.before : fit_with(e, limits);
  d.after = e.fit;
  if (described && best.effects.empty()) d.after = d.before;
  if (described && !best.effects.empty()) {
    FitProblem as_filed = fit_problem;
    as_filed.effects = best.effects;
    Trial trial = prepare(as_filed, baseline, best.effects);
    fit_fully(trial, 6);
    d.after = told(trial.arrival, as_filed, settled(trial), limits);
  }
  d.bic_after = bic_difference(best, baseline) + e.cost + (d.bic_before = d.before.bic());
  for (std::size_t r = 0; r < fit_problem.runs.size(); ++r) {
    for (std::size_t c = 0; c < d.before.runs[r].channels.size(); ++c) {
      const FittedChannel &b = d.before.runs[r].channels[c], &a = e.fit.runs[r].channels[c];
      if (b.name == "alpha") continue;
      d.runs.push_back({fit_problem.runs[r].file, b.name, b.unit, false, false, b.rms_residual, a.rms_residual, std::min(a.noise, b.noise), e.fit.runs[r].aside});
    }
  }
}

std::vector<MissingEffect> effects_of(const FoundSet& found, const Rig& rig, const Diagnosis& d) {
  const Trial& best = found.best;
  std::vector<MissingEffect> set;
  for (const std::string& id : best.effects) {
    if (is_idle(best.arrival.joint, id)) continue;
    const Effect& e = effect(rig, id);
    MissingEffect m{id, probability_of(id, d.ranking), e.equation, is_law_id(id) ? std::string() : e.source, {}};
    m.kind = e.kind;
    for (const FittedParameter& p : found.fit.parameters)
      if (p.effect == id) m.parameters.push_back(p);
    set.push_back(m);
  }
  return set;
}

void tell_equivalent(const FoundSet& found, bool described, const std::vector<Trial>& tried, bool verdict_only, Diagnosis& d) {
  const Trial& best = found.best;
  const auto set_of = [](const Trial& t) { return std::set<std::string>(t.effects.begin(), t.effects.end()); };
  std::set<std::set<std::string>> named;
  if (!described) named.insert(set_of(best));
  for (const Trial& t : tried) {
    const bool other = t.effects.size() <= best.effects.size() + (described ? 1 : 0) && !named.contains(set_of(t));
    if (!other || bic_difference(t, best) - found.cost >= decisive) continue;
    named.insert(set_of(t));
    d.equivalent.push_back(t.effects);
    d.separated_by.push_back(verdict_only ? std::nullopt : separating_recording(best.arrival, t.arrival));
  }
}

MissingEffect missing_description(const RigDescription& description, const FoundSet& found, const FitProblem& fit_problem, const Diagnosis& d) {
  MissingEffect m = description.as_missing();
  m.probability = probability_of(m.effect, d.ranking);
  if (const double change = found.fit.parameters.empty() ? 0 : change_of_load(fit_problem, d.before, *description.problem, found.fit); change != 0)
    m.advice += fmt::format(". With them the loads at the ends of the steps are {:+.2g} % off those of the rig as the file has it", change);
  return m;
}

}  // namespace unrig
