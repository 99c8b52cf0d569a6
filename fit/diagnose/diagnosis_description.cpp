#include "fit/diagnose/diagnosis_description.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <set>
#include <stdexcept>
#include <utility>

#include <fmt/format.h>

#include "core/effects/effect.h"
#include "core/law/law_effect.h"
#include "core/rig/fingerprint.h"
#include "fit/fit_description.h"
#include "fit/givens/inexact_rig.h"
#include "fit/search/screening.h"
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

/// What was found, with the numbers of the files where it has them: in the rig that they make, not in parameters. Where no rig has such numbers, as beside a law that is missing, with those that are stated.
struct AtItsNumbers {
  Eigen::VectorXd off;
  std::shared_ptr<FitProblem> problem;
  Arrival arrival;
};
AtItsNumbers at_its_numbers(const FitProblem& errors, Eigen::VectorXd off, const Arrival& found, const std::vector<std::string>& effects) {
  const StatedNumbers numbers(errors.rig, errors.runs);
  auto there = std::make_shared<FitProblem>();
  const auto take_numbers = [&] {
    there->rig = numbers.rig_at(off);
    there->runs.clear();
    for (std::size_t r = 0; r < errors.runs.size(); ++r) {
      there->runs.push_back(numbers.run_at(r, off));
      there->runs.back().givens = nullptr;
    }
  };
  try {
    take_numbers();
  } catch (const std::invalid_argument&) {
    off.setZero();
    take_numbers();
  }
  there->rig.givens = nullptr;
  there->rig.laws = found.model->rig().laws;
  there->circulation = errors.circulation;
  there->effects = effects;
  Arrival arrival = transferred(*there, found, std::make_shared<const AeroelasticModel>(model_of(there->rig, there->runs, there->circulation, effects)));
  for (Unknown& u : arrival.joint.unknowns())
    for (const Unknown& known : found.joint.unknowns())
      if (known.run == u.run && found.joint.parameter(known).name == arrival.joint.parameter(u).name) u.held = known.held, u.why_held = known.why_held;
  for (RunResidual& run : arrival.joint.runs()) run.temper(1);
  return {std::move(off), std::move(there), std::move(arrival)};
}

/// Effects and the numbers of the files together.
FitResult fit_with_numbers(FitProblem errors, AtItsNumbers& found, Settle settle) {
  errors.effects = found.problem->effects;
  errors.rig.laws = found.problem->rig.laws;
  InexactRig inexact(errors, found.off);
  Arrival arrival = found.arrival;
  solve(arrival);
  inexact.search(arrival);
  FitResult fit = describe_fit(arrival, errors, settle, &inexact);
  found.off = inexact.deviations();
  found.problem->rig = inexact.rig();
  found.problem->runs = inexact.runs();
  return fit;
}

/// The fit with these numbers taken for known. Its rig and its recordings are those of the files.
FitResult told_with_numbers_known(const FitProblem& errors, const AtItsNumbers& found, Settle settle, const SearchLimits& limits) {
  FitResult fit = told(found.arrival, *found.problem, settle, limits);
  for (std::size_t r = 0; r < fit.runs.size(); ++r) fit.runs[r].fingerprint = fingerprint(errors.runs[r], errors.rig);
  fit.rig_fingerprint = fingerprint(errors.rig);
  fit.givens = InexactRig(errors, found.off).numbers();
  for (FittedGiven& g : fit.givens) g.std_error = 0;
  const auto parameters = static_cast<Eigen::Index>(fit.parameters.size()), count = static_cast<Eigen::Index>(fit.givens.size());
  const Eigen::VectorXd deviation = Eigen::VectorXd::NullaryExpr(parameters, [&](Eigen::Index i) {
    const double error = fit.parameters[static_cast<std::size_t>(i)].std_error;
    return std::isfinite(error) ? error : 0;
  });
  fit.joint_covariance = Eigen::MatrixXd::Zero(parameters + count, parameters + count);
  fit.joint_covariance.topLeftCorner(parameters, parameters) = deviation.asDiagonal() * fit.correlation * deviation.asDiagonal();
  fit.warnings.push_back("standard errors are those with the numbers of rig file and heads known, which are uncertain");
  return fit;
}

double probability_of(const std::string& id, const std::vector<Candidate>& ranking) {
  double sum = 0;
  for (const Candidate& c : ranking)
    if (std::find(c.effects.begin(), c.effects.end(), id) != c.effects.end()) sum += c.probability;
  return sum;
}

}  // namespace

void tell_fit(const DiagnoseProblem& problem, const FilesToFit& files, const SearchLimits& limits, FoundSet& found) {
  const bool of_files = found.setting.problem == &files.problem, exact = of_files && !states_errors(problem.rig, problem.runs);
  if (exact) {
    FitProblem after = files.problem;
    after.effects = found.best.effects;
    found.fit = told(found.best.arrival, after, settled(found.best), limits);
    return;
  }
  const FitProblem errors = with_errors_of_files(problem);
  AtItsNumbers there = at_its_numbers(errors, of_files ? deviations_at(files, found.best.arrival.joint) : found.setting.off, found.best.arrival, found.best.effects);
  if (!limits.describe([&] { found.fit = fit_with_numbers(errors, there, settled(found.best)); })) found.fit = told_with_numbers_known(errors, there, Settle::nothing, limits);
  found.fitted = std::move(there.problem);
}

void describe(const DiagnoseProblem& problem, const FilesToFit& files, const Trial& baseline, const SearchLimits& limits, FoundSet& e, Diagnosis& d) {
  const FitProblem& fit_problem = files.problem;
  const Trial& best = e.best;
  const bool stated = states_errors(problem.rig, problem.runs), described = e.setting.problem != &fit_problem;
  if (stated && !d.mismatch.found) {
    tell_fit(problem, files, limits, e);
    d.before = e.fit;
  } else {
    Arrival before = baseline.arrival;
    if (d.mismatch.found) {
      PlainFit plain = plain_fit(fit_problem, baseline.arrival, d.unexplained && !stated && !has_colour(baseline.arrival.joint));  // first guesses know of none
      before = std::move(plain.arrival);
      if (plain.baseline_was_lost) d.not_followed.insert(d.not_followed.begin(), std::vector<std::string>{});
    }
    const Settle settle = d.mismatch.found ? Settle::nothing : Settle::all;  // a fit that explains nothing deserves no refinement
    if (stated) {
      const FitProblem errors = with_errors_of_files(problem);
      AtItsNumbers there = at_its_numbers(errors, deviations_at(files, before.joint), before, {});
      limits.describe([&] { solve(there.arrival); });
      d.before = told_with_numbers_known(errors, there, settle, limits);
    } else {
      d.before = told(before, fit_problem, settle, limits);
    }
    if (best.effects.empty() && !described) e.fit = d.before;
    else tell_fit(problem, files, limits, e);
  }
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
  MissingEffect m = as_missing(found.fitted ? found.fit.givens : description.numbers);
  m.probability = probability_of(m.effect, d.ranking);
  if (const double change = found.fit.parameters.empty() ? 0 : change_of_load(fit_problem, d.before, found.fitted ? *found.fitted : *description.problem, found.fit); change != 0)
    m.advice += fmt::format(". With them the loads at the ends of the steps are {:+.2g} % off those of the rig as the file has it", change);
  return m;
}

}  // namespace unrig
