#include "fit/fit.h"

#include <algorithm>
#include <chrono>
#include <cmath>

#include <fmt/format.h>

#include "core/effects/effect.h"
#include "core/rig/fingerprint.h"
#include "core/run/motion.h"
#include "core/law/law_effect.h"
#include "fit/search/arrival.h"
#include "fit/search/decays_first.h"
#include "fit/effect_option.h"
#include "fit/search/effect_search.h"
#include "fit/fit_description.h"
#include "fit/solver/gauss_newton.h"
#include "fit/givens/inexact_rig.h"
#include "fit/likelihood/law_reach.h"
#include "fit/search/no_worse_than_start.h"
#include "fit/uncertainty/out_of_proportion.h"
#include "fit/likelihood/run_order.h"
#include "fit/uncertainty/uncertainty.h"
#include "fit/uncertainty/undetermined.h"
#include "fit/uncertainty/unfitted_modes.h"
#include "fit/uncertainty/unheard.h"

namespace unrig {
namespace {

bool follows_smooth_laws(const JointProblem& joint) {
  const auto bends = [&](std::size_t r) { return joint.runs()[r].largest_arguments(joint.theta(r)).size() > 0; };
  for (std::size_t r = 0; r < joint.runs().size(); ++r)
    if (bends(r)) return !takes_small_steps(joint);  // those have been chosen for their corners
  return false;
}

/// Of the next Gauss-Newton step of all unknowns together, in standard errors.
double step_left(const JointProblem& joint) {
  const LeastSquaresProblem squares = joint.least_squares();
  return standing(squares, linearise(squares, squares.values())).step_left;
}

/// Halves the steps in which nonlinear laws are followed until half of them would move the unknowns by less than a third of a standard error, all together. The error of a smooth law goes
/// with the fourth power of the step (core/propagate/nonlinear_response.h), by which the next steps are chosen, that of one with kinks with the square: three quarters of it show, and at most
/// four ninths of a standard error are left.
void settle_steps(Arrival& arrival) {
  if (!follows_smooth_laws(arrival.joint)) return;
  constexpr Eigen::Index most = 8;
  constexpr double hardly = 1.0 / 3;
  const auto follow_in = [&](Eigen::Index times) {
    for (RunResidual& run : arrival.joint.runs()) run.follow_in(times);
  };
  for (Eigen::Index times = 1; times < most;) {
    follow_in(2 * times);
    double left = step_left(arrival.joint);
    if (left < hardly) return follow_in(times);
    do {
      times *= 2;
      left /= 16;
    } while (left >= hardly && times < most);
    follow_in(times);
    solve(arrival);
  }
}

/// Noise, motion, and what the data cannot determine: each looked at again once the model fits.
ParameterUncertainty settle(Arrival& arrival, const FitProblem& problem, std::vector<std::string>& warnings) {
  refine(arrival, problem);
  if (const std::string warning = no_worse_than_start(arrival, problem); !warning.empty()) {
    warnings.push_back(warning);
    refine(arrival, problem);
  }
  if (problem.effects.empty()) look_elsewhere(arrival);
  settle_steps(arrival);
  ParameterUncertainty uncertainty = estimate_uncertainty(arrival.joint);
  constexpr int rounds = 4;  // what was a line of the noise may turn out to be nothing at all once its damping is held
  const auto hold = [&] { return hold_unheard(arrival.joint, uncertainty, problem.start) || hold_weak(arrival.joint, uncertainty, problem.start); };
  for (int round = 0; round < rounds && hold(); ++round) {
    solve(arrival);
    uncertainty = estimate_uncertainty(arrival.joint);
  }
  return uncertainty;
}

/// A name that no parameter has must not pass in silence.
void check_names(const AeroelasticModel& model, const FitProblem& problem) {
  std::string names;
  for (const Parameter& p : model.parameters()) names += (names.empty() ? "" : ", ") + p.name;
  const auto known = [&](const std::string& wanted) {
    return std::any_of(model.parameters().begin(), model.parameters().end(), [&](const Parameter& p) { return wanted == p.name || (p.per_run && wanted.starts_with(p.name + " (")); });
  };
  for (const auto& [name, value] : problem.start)
    if (!known(name)) throw InputError({"--start", 0}, "no parameter '" + name + "'", "wanted one of " + names, "");
  for (const std::string& name : problem.profile)
    if (name != "all" && !known(name)) throw InputError({"--profile", 0}, "no parameter '" + name + "' can be profiled", "wanted one of " + names, "Or there is no such file: run files may stand behind the option.");
}

/// A motion that never rests and is too long and too fast for the knots that a fit has: each look at it takes seconds, and its load is not known after hours.
void refuse_endless_motion(const FitProblem& problem) {
  constexpr Eigen::Index slow = 10000;  // samples
  constexpr double far = 3;
  if (problem.rig.is_modal()) return;
  for (const Run& run : problem.runs) {
    const std::vector<MotionBasis::Window> windows = windows_to_fit(run);
    if (windows.size() != 1 || windows.front().knots.length() < slow) continue;
    const Eigen::Index stride = windows.front().stride;
    if (!(off_its_knots(run, windows, stride) > far)) continue;
    throw InputError({run.file, run.header_line}, fmt::format("the angle moves without a rest through {} samples, faster than a knot every {} samples follows", windows.front().knots.length(), stride),
                     fmt::format("wanted a motion that comes to rest, or one of {} samples at most", most_knots_to_fit),
                     "Fit free decays and steps, and give this run to `unrig correct` with that fit: it follows a motion of any length. Or fit the beginning of the record.");
  }
}

}  // namespace

double FitResult::bic() const { return chi2 + std::log(static_cast<double>(observations)) * static_cast<double>(variables); }

AeroelasticModel model_of(const Rig& rig, const std::vector<Run>& runs, Wagner circulation, const std::vector<std::string>& effects) {
  const auto complete = [&](const AeroelasticModel& model) { return effects.empty() ? model : model.with_effects(effects); };
  if (rig.is_modal()) return complete({rig, {}, wagner(circulation)});
  Rig richer = rig;
  if (std::any_of(effects.begin(), effects.end(), [&](const std::string& id) { return effect(rig, id).enriches_basis; })) richer.normal.modes = 0;
  Basis basis;
  for (const Run& run : runs) {
    Basis wanted = make_basis(richer, 0.5 / run.dt, run.density);
    if (wanted.size() > basis.size()) basis = std::move(wanted);
  }
  return complete({rig, basis, wagner(circulation)});
}

FitResult describe_fit(Arrival& arrival, const FitProblem& problem, Settle first, InexactRig* inexact) {
  FitResult result;
  result.rig_file = problem.rig.file;
  result.rig_fingerprint = fingerprint(problem.rig);
  result.circulation = problem.circulation;
  result.effects = problem.effects;
  result.warnings = problem.rig.warnings;
  for (const Run& run : problem.runs) result.warnings.insert(result.warnings.end(), run.warnings.begin(), run.warnings.end());
  for (RunResidual& run : arrival.joint.runs()) run.temper(1);
  ParameterUncertainty uncertainty = first == Settle::nothing ? estimate_uncertainty(arrival.joint) : settle(arrival, problem, result.warnings);
  InexactUncertainty with_numbers;
  if (inexact) {
    inexact->search(arrival);
    with_numbers = inexact->uncertainty(arrival);
    uncertainty = with_numbers.parameters;
  }
  result.normal_modes = arrival.model->basis().normal_modes;
  result.torsion_modes = arrival.model->basis().torsion_modes;
  result.evaluations = arrival.evaluations;
  result.converged = arrival.converged;
  result.message = arrival.message;

  const JointProblem& joint = arrival.joint;
  result.law_steps = joint.runs().front().finer();
  const JointProblem::Linearisation lin = joint.linearise();
  result.chi2 = lin.chi2();
  for (const Unknown& u : joint.unknowns()) result.variables += u.held ? 0 : 1;
  for (std::size_t r = 0; r < joint.runs().size(); ++r) {
    const RunResidual& run = joint.runs()[r];
    result.observations += run.is_aside() ? 0 : run.observations();
    result.variables += run.is_aside() ? 0 : run.linear_unknowns();
    result.runs.push_back(describe_run(run, joint.theta(r), run.is_aside() ? run.evaluate(joint.theta(r), Partials::none).chi2 : lin.run_chi2[r]));
  }
  result.learnt_on = reach_of_laws(joint);
  result.noise_colour = noise_colours(joint);
  describe_parameters(joint, uncertainty, problem.start, result);
  if (inexact) inexact->describe(joint, with_numbers, result);
  if (inexact && !problem.profile.empty()) {
    result.warnings.push_back("profiles are those with the numbers of rig file and runs known; the standard errors allow for what they state");
    uncertainty = estimate_uncertainty(joint);
  }
  describe_profiles(joint, uncertainty, problem, result);
  judge_answer(result);
  judge_misfit(joint, uncertainty, result);
  refuse_unfitted_modes(joint, result);
  warn_of_silent_runs(joint, result);
  warn_of_mismatch(result);
  for (const std::string& warning : out_of_proportion(result.parameters)) result.warnings.push_back(warning);
  return result;
}

namespace {

FitResult fit_in_order(const FitProblem& problem) {
  const auto begin = std::chrono::steady_clock::now();
  refuse_idle("--effect", problem.effects, problem.rig, problem.runs);
  refuse_endless_motion(problem);
  const auto model = std::make_shared<const AeroelasticModel>(model_of(problem.rig, problem.runs, problem.circulation, problem.effects));
  check_names(*model, problem);
  std::optional<InexactRig> inexact;
  if (states_errors(problem.rig, problem.runs)) inexact.emplace(problem);
  ArrivalEffort effort;
  effort.other_starts = !inexact;  // what the rig file's numbers leave unexplained is not for other stiffnesses to explain
  Arrival arrival = problem.effects.empty() ? arrive(problem, model, effort) : arrive_at_effects(problem);
  check_lengths(arrival.joint);
  if (inexact) inexact->search(arrival);
  FitResult result = describe_fit(arrival, problem, Settle::all, inexact ? &*inexact : nullptr);
  result.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  return result;
}

}  // namespace

FitResult fit(const FitProblem& problem) {
  const std::vector<std::size_t> order = order_of_search(problem.runs);
  if (is_as_given(order)) return fit_in_order(problem);
  FitProblem ordered = problem;
  ordered.runs = in_order(problem.runs, order);
  FitResult result = fit_in_order(ordered);
  tell_as_given(GivenOrder(problem.runs), result);
  return result;
}

}  // namespace unrig
