#include "fit/diagnose/diagnose.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <memory>
#include <set>

#include "core/effects/effect.h"
#include "core/files/error.h"
#include "core/rig/fingerprint.h"
#include "core/numerics/in_parallel.h"
#include "fit/search/decays_first.h"
#include "fit/diagnose/heldout.h"
#include "fit/diagnose/selection.h"
#include "fit/search/effect_search.h"
#include "fit/fit_description.h"
#include "fit/givens/inexact_rig.h"
#include "fit/likelihood/run_order.h"

namespace unrig {
namespace {

using Eigen::Index;

constexpr double half = 0.5;  // of the excess, where decays decide: the search leaves something of the other runs even when it has found what is missing
constexpr double twice_the_noise = 2;

/// Whether decays that decide are followed, to the noise or in nearly all that they had above it.
bool follows_decays(const Trial& trial, const Trial& baseline) {
  if (!decays_decide(trial) || trial.excess() > half * baseline.excess()) return false;
  const bool nearly = trial.decays.exactly && left_of_decays(trial) - 1 < (1 - enough_to_name) * (left_of_decays(baseline) - 1);
  return trial.decays.chi2 < explained || nearly;
}

/// `best` has effects; `clean`: beside them no significant mismatch remains.
Naming naming_of(const Trial& best, const Trial& baseline, bool clean, bool predicts) {
  if (!predicts) return Naming::does_not_predict;
  if (clean || follows_decays(best, baseline)) return Naming::named;
  if (best.excess() > (1 - enough_to_name) * baseline.excess()) return Naming::removes_too_little;
  const bool only_signals = std::all_of(best.effects.begin(), best.effects.end(), [&](const std::string& id) { return is_a_signal(id, best.arrival.joint); });
  return only_signals ? Naming::only_signals : Naming::named;
}

/// What runs that were not fitted are left with, before and after.
std::vector<ImprovedRun> predict_unseen(const DiagnoseProblem& problem, const FitProblem& fit_problem, const Arrival& baseline, const Trial& best) {
  FitProblem after = fit_problem;
  after.effects = best.effects;
  const bool leave_out = problem.heldout.empty() && problem.runs.size() > 1 && !best.effects.empty();
  const std::vector<RunResidual>& fitted = best.arrival.joint.runs();
  const auto has_part = [](const RunResidual& run) { return !run.is_aside(); };
  const bool others_tell = std::count_if(fitted.begin(), fitted.end(), has_part) > 1;
  std::vector<std::size_t> predicted;  // not what no search follows, nor what nothing but itself has told of
  for (std::size_t i = 0; i < (leave_out ? problem.runs.size() : problem.heldout.size()); ++i)
    if (!leave_out || (has_part(fitted[i]) && others_tell)) predicted.push_back(i);
  std::vector<ImprovedRun> unseen(predicted.size());
  in_parallel(unseen.size(), [&](std::size_t i) {
    const Run& run = leave_out ? problem.runs[predicted[i]] : problem.heldout[predicted[i]];
    const HeldoutResidual b = leave_out ? predict_left_out(baseline, fit_problem, predicted[i]) : predict_heldout(baseline, fit_problem, run);
    const HeldoutResidual a = leave_out ? predict_left_out(best.arrival, after, predicted[i]) : predict_heldout(best.arrival, after, run);
    unseen[i] = {run.file, b.channel, run.channel(b.channel).unit, true, leave_out, b.rms, a.rms, a.noise};
  });
  return unseen;
}

double power_over_noise(const std::vector<ImprovedRun>& runs, double ImprovedRun::* rms) {
  double sum = 0;
  for (const ImprovedRun& run : runs) sum += std::pow(run.*rms / run.noise, 2);
  return sum;
}

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
  constexpr double hardly_less = 0.9;
  const double before = plain.arrival.joint.chi2(), after = anew.joint.chi2();
  plain.baseline_was_lost = after < hardly_less * before;
  if (after < before) plain.arrival = std::move(anew);
  return plain;
}

bool has_colour(const JointProblem& joint) {
  return std::any_of(joint.runs().begin(), joint.runs().end(), [](const RunResidual& run) { return run.colour(0) != nullptr; });
}

/// Both fits in full, and what they leave of the fitted runs.
void describe(const DiagnoseProblem& problem, const FitProblem& fit_problem, const Trial& baseline, const Trial& best, Diagnosis& d) {
  FitProblem after = fit_problem;
  after.effects = best.effects;
  Arrival before_arrival = baseline.arrival, after_arrival = best.arrival;
  if (d.mismatch.found) {
    PlainFit plain = plain_fit(fit_problem, baseline.arrival, d.unexplained && !has_colour(baseline.arrival.joint));  // first guesses know of none
    before_arrival = std::move(plain.arrival);
    if (plain.baseline_was_lost) d.not_followed.insert(d.not_followed.begin(), std::vector<std::string>{});
  }
  d.before = describe_fit(before_arrival, fit_problem, d.mismatch.found ? Settle::nothing : Settle::noise);  // a fit that explains nothing deserves no refinement
  d.after = best.effects.empty() ? d.before : describe_fit(after_arrival, after, best.reduced_chi2() < twice_the_noise ? Settle::noise : Settle::nothing);
  d.bic_after = bic_difference(best, baseline) + (d.bic_before = d.before.bic());
  for (std::size_t r = 0; r < problem.runs.size(); ++r) {
    for (std::size_t c = 0; c < d.before.runs[r].channels.size(); ++c) {
      const FittedChannel &b = d.before.runs[r].channels[c], &a = d.after.runs[r].channels[c];
      if (b.name == "alpha") continue;
      d.runs.push_back({problem.runs[r].file, b.name, b.unit, false, false, b.rms_residual, a.rms_residual, std::min(a.noise, b.noise), d.after.runs[r].aside});
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

/// The sets of `tried` that are as good as the best, each once, in whatever order its effects were found.
void name_equivalent(const Trial& baseline, const Trial& best, const std::vector<Trial>& tried, bool verdict_only, Diagnosis& d) {
  const double best_bic = bic_difference(best, baseline);
  const auto set_of = [](const Trial& t) { return std::set<std::string>(t.effects.begin(), t.effects.end()); };
  std::set<std::set<std::string>> named{set_of(best)};
  for (const Trial& t : tried) {
    const bool other = t.effects.size() <= best.effects.size() && !named.contains(set_of(t));
    if (!other || bic_difference(t, baseline) - best_bic >= decisive) continue;
    named.insert(set_of(t));
    d.equivalent.push_back(t.effects);
    d.separated_by.push_back(verdict_only ? std::nullopt : separating_recording(best.arrival, t.arrival));
  }
}

/// So short that nothing missing could be seen: "nothing is missing" would be no answer.
void refuse_short_runs(const JointProblem& joint) {
  check_lengths(joint);
  Index observations = 0, variables = 0;
  for (const Unknown& u : joint.unknowns()) variables += u.held ? 0 : 1;
  for (const RunResidual& run : joint.runs()) observations += run.observations(), variables += run.linear_unknowns();
  if (const std::string why = too_few_samples(observations, variables); !why.empty()) throw NoAnswer(why);
}

/// A fit to numbers that are taken for known from here on: the ones that the fit with nothing missing found. Its recordings are those of the files.
void describe_numbers(const DiagnoseProblem& problem, const std::vector<FittedGiven>& numbers, FitResult& fit) {
  if (fit.parameters.empty()) return;
  for (std::size_t r = 0; r < fit.runs.size(); ++r) fit.runs[r].fingerprint = fingerprint(problem.runs[r], problem.rig);
  fit.rig_fingerprint = fingerprint(problem.rig);
  const auto parameters = static_cast<Index>(fit.parameters.size()), count = static_cast<Index>(numbers.size());
  Eigen::VectorXd deviation(parameters);
  for (Index i = 0; i < parameters; ++i) {
    const double error = fit.parameters[static_cast<std::size_t>(i)].std_error;
    deviation[i] = std::isfinite(error) ? error : 0;
  }
  fit.givens = numbers;
  for (FittedGiven& g : fit.givens) g.std_error = 0;
  fit.joint_covariance = Eigen::MatrixXd::Zero(parameters + count, parameters + count);
  fit.joint_covariance.topLeftCorner(parameters, parameters) = deviation.asDiagonal() * fit.correlation * deviation.asDiagonal();
  fit.warnings.push_back("the numbers that state their uncertainty stand at what the fit with nothing missing made of them; standard errors are those with these numbers known");
}

/// Of a rig or of runs that state uncertainties: with the numbers that fit the runs best, nothing missing, within what is stated. What they explain is not looked for.
Diagnosis diagnose_inexact(const DiagnoseProblem& problem) {
  FitProblem stated;
  stated.rig = problem.rig;
  stated.runs = problem.runs;
  stated.circulation = problem.circulation;
  stated.progress = problem.progress;
  Arrival arrival = arrive(stated, std::make_shared<const AeroelasticModel>(model_of(stated.rig, stated.runs, stated.circulation)));
  InexactRig inexact(stated);
  inexact.search(arrival);
  DiagnoseProblem at = problem;
  at.rig = inexact.rig();
  at.runs = inexact.runs();
  at.rig.givens = nullptr;
  for (Run& run : at.runs) run.givens = nullptr;
  const std::vector<FittedGiven> numbers = inexact.numbers();
  Diagnosis d = diagnose(at);
  for (FitResult* fit : {&d.before, &d.after}) describe_numbers(problem, numbers, *fit);
  return d;
}

}  // namespace

namespace {

Diagnosis diagnose_in_order(const DiagnoseProblem& problem) {
  if (states_errors(problem.rig, problem.runs)) return diagnose_inexact(problem);
  const auto begin = std::chrono::steady_clock::now();
  const auto tell = [&](const std::string& what) {
    if (problem.progress) problem.progress(what);
  };
  FitProblem fit_problem;
  fit_problem.rig = problem.rig;
  fit_problem.runs = problem.runs;
  fit_problem.circulation = problem.circulation;

  tell("fitting the rig with nothing missing");
  Trial baseline = fit_baseline(fit_problem);
  refuse_short_runs(baseline.arrival.joint);
  Diagnosis d;
  d.mismatch = locate_mismatch(baseline.arrival.joint);
  bool coloured = d.mismatch.found && take_noise_colour(baseline);
  auto selection = std::make_unique<Selection>(problem, fit_problem, baseline);
  Trial best = selection->best_set(!coloured);
  if (selection->coloured()) {
    tell("trying what may be missing, in noise of the colour that is left");
    coloured = true;
    take_noise_of(baseline, *selection->coloured());
    selection = std::make_unique<Selection>(problem, fit_problem, baseline);
    best = selection->best_set(false);
  }
  if (coloured) d.mismatch = locate_mismatch(baseline.arrival.joint);
  if (!problem.verdict_only) d.maps = residual_maps(baseline.arrival.joint, d.mismatch.runs);
  d.ranking = selection->ranking();
  d.remaining = what_remains(best);
  const bool clean = !d.remaining.found;
  const std::vector<ImprovedRun> unseen = problem.verdict_only ? std::vector<ImprovedRun>{} : predict_unseen(problem, fit_problem, baseline.arrival, best);
  const bool predicts = best.effects.empty() || power_over_noise(unseen, &ImprovedRun::rms_after) <= power_over_noise(unseen, &ImprovedRun::rms_before);
  d.unexplained = d.mismatch.found && !(clean && predicts);

  if (d.unexplained)
    for (const Candidate& c : d.ranking)
      if (c.search == SearchOutcome::failed) d.not_followed.push_back(c.effects);

  if (!problem.verdict_only) {
    tell("describing the result");
    describe(problem, fit_problem, baseline, best, d);
    for (const ImprovedRun& run : unseen) d.runs.push_back(run);
    if (d.unexplained) d.missing_force = missing_forces(best.arrival.joint);
  }
  if (!d.not_followed.empty()) d.search = SearchOutcome::failed;
  if (!best.effects.empty()) {
    d.naming = naming_of(best, baseline, clean, predicts);
    if (d.naming == Naming::named) name_equivalent(baseline, best, selection->tried(), problem.verdict_only, d);
    else d.removed_by_closest = 1 - best.excess() / baseline.excess();
    (d.naming == Naming::named ? d.missing : d.closest) = effects_of(best, d);
  }
  d.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  return d;
}

void sort_mismatch(const GivenOrder& given, Mismatch& m) {
  given.sort(m.channels, [](const ChannelMismatch& c) { return c.run; });
  const Mismatch was = m;
  const std::vector<std::size_t> places = given.places(m.runs, [](const std::string& file) { return file; });
  for (std::size_t i = 0; i < places.size(); ++i) {
    m.runs[i] = was.runs[places[i]];
    m.time[i] = was.time[places[i]];
    m.frequency[i] = was.frequency[places[i]];
    m.state[i] = was.state[places[i]];
  }
}

/// What was found in the order of the search, told in that in which the runs were given.
void tell_as_given(const GivenOrder& given, std::size_t runs, Diagnosis& d) {
  sort_mismatch(given, d.mismatch);
  sort_mismatch(given, d.remaining);
  for (std::vector<MissingEffect>* effects : {&d.missing, &d.closest})
    for (MissingEffect& m : *effects) given.sort_by_name(m.parameters);
  const auto fitted = [](const ImprovedRun& run) { return !run.heldout; };
  const auto unseen = std::stable_partition(d.runs.begin(), d.runs.end(), fitted);
  std::vector<ImprovedRun> seen(d.runs.begin(), unseen), others(unseen, d.runs.end());
  for (std::vector<ImprovedRun>* part : {&seen, &others}) given.sort(*part, [](const ImprovedRun& run) { return run.file; });
  d.runs = std::move(seen);
  d.runs.insert(d.runs.end(), others.begin(), others.end());
  given.sort(d.maps, [](const ResidualMaps& m) { return m.run; });
  given.sort(d.missing_force, [](const MissingForce& f) { return f.run; });
  for (FitResult* fit : {&d.before, &d.after})
    if (fit->runs.size() == runs) tell_as_given(given, *fit);  // a verdict alone has none
}

}  // namespace

Diagnosis diagnose(const DiagnoseProblem& problem) {
  const std::vector<std::size_t> order = order_of_search(problem.runs);
  if (is_as_given(order)) return diagnose_in_order(problem);
  DiagnoseProblem ordered = problem;
  ordered.runs = in_order(problem.runs, order);
  Diagnosis d = diagnose_in_order(ordered);
  tell_as_given(GivenOrder(problem.runs), problem.runs.size(), d);
  return d;
}

}  // namespace unrig
