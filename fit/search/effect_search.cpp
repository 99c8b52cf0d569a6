#include "fit/search/effect_search.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>

#include "core/effects/effect.h"
#include "core/law/law_effect.h"
#include "core/numerics/in_parallel.h"
#include "fit/search/decays_first.h"
#include "fit/fit.h"
#include "fit/search/find_motion.h"
#include "fit/search/left_of_runs.h"
#include "fit/search/noise_of_trial.h"
#include "fit/search/own_parameters.h"
#include "fit/likelihood/readings_noise.h"
#include "fit/uncertainty/undetermined.h"

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

/// Weights of the runs such that each is left with about the power of its noise; true where that changed any by more than a tenth.
bool temper(JointProblem& joint) {
  bool changed = false;
  const std::vector<LeftOfRun> left = left_of_runs(joint);
  for (std::size_t r = 0; r < left.size(); ++r) {
    if (joint.runs()[r].is_aside() || !(left[r].variance < run_away)) continue;
    const double factor = std::sqrt(std::max(1.0, left[r].variance)), now = factor < 1.1 ? 1.0 : factor;
    changed = changed || std::abs(std::log(now / joint.runs()[r].tempered())) > 0.1;
    joint.runs()[r].temper(now);
  }
  return changed;
}

/// At the corners of a law slopes promise what steps do not keep: a search ends where they promise less than so much of chi-square.
double precision_at_corners(const JointProblem& joint) {
  constexpr double some = 0.02;
  double freedom = 0;
  for (const RunResidual& run : joint.runs()) freedom += run.is_aside() ? 0 : static_cast<double>(run.degrees_of_freedom());
  return std::sqrt(some * freedom);
}

/// False where `goal`, told in the weights with which it begins, is out of reach.
bool anneal(Arrival& arrival, int rounds, const Goal& goal) {
  const bool has_corners = takes_small_steps(arrival.joint);
  for (int round = 0; round < rounds; ++round) {
    JointProblem::SolveOptions options;
    options.iterations = has_corners ? 3 : 8;
    options.tolerance = 1e-3;
    options.precision = has_corners ? precision_at_corners(arrival.joint) : 0.5;  // candidates differ by more than half a standard error, or cannot be told apart
    options.most_evaluations = 12;
    if (round == 0) options.goal = goal;
    if (solve(arrival, options).out_of_reach) return false;
    for (std::size_t r = 0; r < arrival.joint.runs().size(); ++r) settle_wandering(arrival.joint.runs()[r], arrival.joint.theta(r));
    if (!temper(arrival.joint)) break;
  }
  return true;
}

/// Whether an effect is a nonlinear law in any of the runs.
bool is_a_law(const std::string& id, const AeroelasticModel& rig, const JointProblem& joint) {
  const AeroelasticModel model = rig.with_effects({id});
  return std::any_of(joint.runs().begin(), joint.runs().end(), [&](const RunResidual& run) { return !model.system(run.conditions(), model.start_values(), run.channels()).feedback.empty(); });
}

/// The effects of a problem: those that are linear in every run, then each of the others by itself.
std::vector<std::vector<std::string>> in_order(const FitProblem& problem, const JointProblem& joint) {
  std::vector<std::vector<std::string>> order(1);
  const AeroelasticModel rig = model_of(problem.rig, problem.runs, problem.circulation);
  for (const std::string& id : problem.effects) {
    if (is_a_law(id, rig, joint)) order.push_back({id});
    else order.front().push_back(id);
  }
  if (order.front().empty()) order.erase(order.begin());
  return order;
}

}  // namespace

void measure(Trial& trial) {
  JointProblem& joint = trial.arrival.joint;
  trial.variance.clear();
  trial.samples.clear();
  trial.angle_variance.clear();
  trial.angle_samples.clear();
  trial.variables = 0;
  const std::vector<LeftOfRun> left = left_of_runs(joint);
  for (std::size_t r = 0; r < left.size(); ++r) {
    const bool as_trusted = !trial.decays.exactly && std::isfinite(trial.decays.chi2) && joint.runs()[r].motion().unknowns() == 0;
    trial.variance.push_back(as_trusted ? std::max(1.0, trial.decays.chi2) : left[r].variance);
    trial.samples.push_back(left[r].independent);
    trial.angle_variance.push_back(left[r].angle_variance);
    trial.angle_samples.push_back(left[r].angle_samples);
    trial.variables += left[r].unknowns;
  }
  for (const Unknown& u : joint.unknowns()) trial.variables += u.held ? 0 : 1;
}

bool any_aside(const JointProblem& joint) {
  return std::any_of(joint.runs().begin(), joint.runs().end(), [](const RunResidual& run) { return run.is_aside(); });
}

bool nonlinear(const Trial& trial) {
  const JointProblem& joint = trial.arrival.joint;
  return std::any_of(joint.runs().begin(), joint.runs().end(), [&, r = std::size_t{0}](const RunResidual& run) mutable {
    return !run.model().system(run.conditions(), joint.theta(r++), run.channels()).feedback.empty();
  });
}

bool is_a_law(const std::string& id, const JointProblem& joint) {
  const AeroelasticModel& model = joint.model();
  return is_a_law(id, AeroelasticModel(model.rig(), model.basis(), model.circulation()), joint);
}

bool brings_a_law(const Trial& trial) { return is_a_law(trial.effects.back(), trial.arrival.joint); }

bool is_a_signal(const std::string& id, const JointProblem& joint) {
  const AeroelasticModel& all = joint.model();
  const AeroelasticModel model = AeroelasticModel(all.rig(), all.basis(), all.circulation()).with_effects({id});
  return std::any_of(joint.runs().begin(), joint.runs().end(), [&](const RunResidual& run) { return !model.system(run.conditions(), model.start_values(), run.channels()).exogenous.empty(); });
}

double Trial::reduced_chi2() const {
  double power = 0, count = 0;
  for (std::size_t r = 0; r < variance.size(); ++r) {
    const auto n = static_cast<double>(arrival.joint.runs()[r].run().samples());
    power += n * variance[r];
    count += n;
  }
  return power / count;
}

double Trial::excess() const {
  double power = 0, count = 0;
  for (std::size_t r = 0; r < variance.size(); ++r) {
    const auto n = static_cast<double>(arrival.joint.runs()[r].run().samples());
    power += n * std::max(0.0, variance[r] - 1);
    count += n;
  }
  return power / count;
}

namespace {

/// Logarithm of what a run's variance is told in units of, a square of its noise in what its file counts in, however that is calibrated; of its innovations where a force wanders.
double log_unit(const RunResidual& run) {
  double sum = 0;
  for (std::size_t c = 0; c < run.channels().size(); ++c) sum += 2 * std::log(run.sigma(c) / run.run().find(run.channels()[c])->factor);
  return sum / static_cast<double>(run.channels().size());
}

const Trial& better_of(const Trial& a, const Trial& b) { return a.reduced_chi2() < b.reduced_chi2() ? a : b; }

}  // namespace

double deviance_difference(const Trial& a, const Trial& b) {
  const Trial& better = better_of(a, b);
  double difference = a.arrival.joint.beside_runs() - b.arrival.joint.beside_runs();
  for (std::size_t r = 0; r < a.variance.size(); ++r) {
    difference += better.samples[r] * (std::log(a.variance[r] / b.variance[r]) + log_unit(a.arrival.joint.runs()[r]) - log_unit(b.arrival.joint.runs()[r]));
    // Of a run that is not explained the gauge is weighted down, and does not bend the motion.
    if (a.angle_samples[r] > 0 && std::max(a.arrival.joint.runs()[r].tempered(), b.arrival.joint.runs()[r].tempered()) == 1) difference += b.angle_samples[r] * std::log(a.angle_variance[r] / b.angle_variance[r]);
  }
  return difference;
}

double bic_difference(const Trial& a, const Trial& b) {
  double total = 0;
  for (const double samples : better_of(a, b).samples) total += samples;
  return deviance_difference(a, b) + (a.variables - b.variables) * std::log(total);
}

Trial fit_baseline(const FitProblem& problem) {
  const auto model = std::make_shared<const AeroelasticModel>(model_of(problem.rig, problem.runs, problem.circulation));
  const ArrivalEffort effort{false, 10, 0.5, 15};
  Trial trial{{}, arrive(problem, model, effort)};
  temper(trial.arrival.joint);
  anneal(trial.arrival, 5, {});
  measure(trial);
  return trial;
}

namespace {

/// Those that the base lacks.
std::vector<std::string> added_to(const Trial& base, const std::vector<std::string>& effects) {
  std::vector<std::string> added;
  for (const std::string& id : effects)
    if (std::find(base.effects.begin(), base.effects.end(), id) == base.effects.end()) added.push_back(id);
  return added;
}

std::shared_ptr<const AeroelasticModel> model_with(const FitProblem& problem, const std::vector<std::string>& effects) {
  return std::make_shared<const AeroelasticModel>(model_of(problem.rig, problem.runs, problem.circulation, effects));
}

void glance(Trial& trial, bool only) {
  for (RunResidual& run : trial.arrival.joint.runs()) run.glance(only);
}

}  // namespace

Trial screened(const FitProblem& problem, const Screening& screening, const Trial& base, const std::vector<std::string>& effects) {
  Screening::Extended extended = screening.extend(model_with(problem, effects), added_to(base, effects));
  Trial trial{effects, std::move(extended.arrival), extended.left, extended.share};
  if (any_aside(trial.arrival.joint)) trial.decays = base.decays;
  return trial;
}

std::vector<Trial> screened_beside(const FitProblem& problem, const Trial& base, const std::vector<std::string>& ids) {
  if (ids.empty()) return {};
  const Screening screening(problem, base.arrival);
  std::vector<std::optional<Trial>> each(ids.size());
  in_parallel(ids.size(), [&](std::size_t i) {
    std::vector<std::string> set = base.effects;
    set.push_back(ids[i]);
    each[i] = screened(problem, screening, base, set);
  });
  std::vector<Trial> trials;
  for (std::optional<Trial>& trial : each) trials.push_back(std::move(*trial));
  return trials;
}

bool may_be_seen(const Trial& screened, const Trial& base) {
  double samples = 0;
  for (const double n : base.samples) samples += n;
  return base.reduced_chi2() > nearly_explained || samples * screened.score > decisive;
}

bool hold_undetermined(Trial& trial) {
  glance(trial, true);
  const bool told = hold_undetermined(trial.arrival.joint);
  glance(trial, false);
  return told;
}

Trial prepare(const FitProblem& problem, const Screening& screening, const Trial& base, const std::vector<std::string>& effects) {
  Trial trial = screened(problem, screening, base, effects);
  hold_undetermined(trial);
  return trial;
}

Trial prepare(const FitProblem& problem, const Trial& base, const std::vector<std::string>& effects) {
  if (!added_to(base, effects).empty()) return prepare(problem, Screening(problem, base.arrival), base, effects);
  Trial fewer{effects, transferred(problem, base.arrival, model_with(problem, effects))};
  if (any_aside(fewer.arrival.joint)) fewer.decays = base.decays;
  glance(fewer, true);
  fewer.promised_left = left_by_a_step(fewer.arrival.joint);
  hold_undetermined(fewer.arrival.joint);
  glance(fewer, false);
  return fewer;
}

namespace {

/// False where it ended at once because `goal`, a chi-square with the weights that the runs have by now, is out of reach.
bool fit_towards(const Goal& goal, Trial& trial, int rounds) {
  const bool reaches = anneal(trial.arrival, rounds, goal);
  measure(trial);
  trial.is_settled = false;
  return reaches;
}

}  // namespace

void fit_fully(Trial& trial, int rounds) { fit_towards({}, trial, rounds); }

void settle(Trial& trial) {
  solve(trial.arrival, {});
  measure(trial);
  trial.is_settled = true;
}

namespace {

/// Whether the decays show that a law is missed: of thousands of samples twice the excess is beyond any evidence.
bool is_missed_by_decays(Trial& fewer, const Trial& with) {
  if (!has_decays(fewer.arrival.joint) || any_aside(with.arrival.joint) || !nonlinear(fewer)) return false;
  fit_decays(fewer.arrival.joint, fewer.effects.back(), true);
  measure(fewer);
  return left_of_decays(fewer) - 1 > 2 * std::max(left_of_decays(with), explained) - 2;
}

/// Whether an effect is missed before anything is fitted without it. Of a signal, if a step from where the fit stands leaves far more than what it saves in parameters: a step follows signals.
bool is_missed(Trial& fewer, const Trial& with, const std::string& id) {
  const JointProblem& joint = with.arrival.joint;
  if (is_a_law(id, joint)) return is_missed_by_decays(fewer, with);
  measure(fewer);
  double samples = 0;
  for (const double n : with.samples) samples += n;
  const double lost = fewer.promised_left - joint.chi2(), saved = (with.variables - fewer.variables) * std::log(samples);
  return half_of_it * lost > saved + decisive;
}

}  // namespace

std::vector<Trial> taken_away(const FitProblem& problem, const Trial& trial) {
  std::vector<Trial> smaller;
  const auto now = [&]() -> const Trial& { return smaller.empty() ? trial : smaller.back(); };
  for (std::size_t k = 0; now().effects.size() > 1 && k < now().effects.size();) {
    std::vector<std::string> effects = now().effects;
    const std::string id = effects[k];
    effects.erase(effects.begin() + static_cast<std::ptrdiff_t>(k));
    Trial fewer = prepare(problem, now(), effects);
    if (is_missed(fewer, now(), id)) {
      ++k;
      continue;
    }
    fit_fully(fewer, 6);
    if (bic_difference(fewer, now()) < decisive) smaller.push_back(std::move(fewer));
    else ++k;
  }
  return smaller;
}

void leave_out_terms(Trial& trial) {
  const std::vector<std::string> ids = trial.effects;
  for (const std::string& id : ids) {
    const Effect& e = effect(trial.arrival.joint.model().rig(), id);
    for (const std::vector<Index>& term : e.terms) {
      Trial fewer = trial;
      for (Unknown& u : fewer.arrival.joint.unknowns())
        for (const Index k : term) {
          if (const Parameter& p = fewer.arrival.joint.parameter(u); p.effect != id || p.place != static_cast<int>(k)) continue;
          if (k == term.front()) u.value = 0;
          u.held = true;
          u.why_held = "These runs are explained as well without its term";
        }
      fit_fully(fewer, 2);
      if (bic_difference(fewer, trial) < 0) trial = std::move(fewer);
    }
  }
}

void follow_finer(Trial& trial, Index times) {
  JointProblem& joint = trial.arrival.joint;
  for (RunResidual& run : joint.runs()) run.follow_in(times);
  fit_fully(trial, 2);
  const auto lost = [&](std::size_t r) { return joint.runs()[r].motion().unknowns() > 0 && trial.variance[r] > explained; };
  bool any = false;
  for (std::size_t r = 0; r < joint.runs().size(); ++r) any = any || lost(r);
  if (!any) return;
  fit_own_parameters(joint);  // theta is nearer now
  temper(joint);
  fit_fully(trial, 2);
}

namespace {

/// Square sum of what finer steps alone move the readings by, over the noise.
double moved_by_steps(const JointProblem& joint, Index times) {
  std::vector<double> moved(joint.runs().size());
  in_parallel(moved.size(), [&](std::size_t r) {
    RunResidual run = joint.runs()[r];
    if (run.is_aside()) return;
    const Eigen::MatrixXd before = run.predict(joint.theta(r)).output;
    run.follow_in(times);
    const Eigen::MatrixXd after = run.predict(joint.theta(r)).output;
    for (Index c = 0; c < after.cols(); ++c) moved[r] += (run.channel_weight(static_cast<std::size_t>(c)).array() * (after - before).col(c).array()).square().sum();
  });
  return std::accumulate(moved.begin(), moved.end(), 0.0);
}

}  // namespace

Trial in_finer_steps(const Trial& trial) {
  constexpr Eigen::Index finer = 4;
  if (trial.effects.empty() || !nonlinear(trial) || decays_decide(trial) || trial.reduced_chi2() > nearly_explained || trial.excess() == 0 || trial.arrival.joint.runs().front().finer() >= finer) return trial;
  constexpr double of_its_root = 0.293;  // 1 - sqrt(half_of_it): what moves the readings by less does not take half of what they are left with, by the triangle inequality
  double samples = 0;
  for (const RunResidual& run : trial.arrival.joint.runs()) samples += static_cast<double>(run.run().samples());
  if (moved_by_steps(trial.arrival.joint, finer) < of_its_root * of_its_root * samples * trial.excess()) return trial;
  Trial again = trial;
  follow_finer(again, finer);
  return again.excess() < half_of_it * trial.excess() ? again : trial;
}

double left_of_decays(const Trial& trial) {
  double power = 0, count = 0;
  for (std::size_t r = 0; r < trial.variance.size(); ++r) {
    const RunResidual& run = trial.arrival.joint.runs()[r];
    if (run.motion().unknowns() > 0) continue;
    power += static_cast<double>(run.run().samples()) * trial.variance[r];
    count += static_cast<double>(run.run().samples());
  }
  return power / count;
}

bool decays_decide(const Trial& trial) { return takes_small_steps(trial.arrival.joint) && has_decays(trial.arrival.joint); }

bool fit_decays_first(Trial& trial, const Trial& base, bool from_here) {
  JointProblem& joint = trial.arrival.joint;
  const double before = left_of_decays(base), followed = takes_small_steps(joint) ? explained : twice_the_noise;  // corners are seen where a fit with everything free loses its way
  if (!has_decays(joint) || before < followed) {
    measure(trial);
    return !has_decays(joint) || !takes_small_steps(joint);  // a gap would show
  }
  trial.decays = fit_decays(joint, trial.effects.back(), from_here);
  const bool helps = trial.decays.chi2 - 1 < half_of_it * (before - 1);
  measure(trial);
  if (helps) {
    in_noise_of_decays(trial, [&] {
      in_parallel(joint.runs().size(), [&](std::size_t r) {  // c of the others still is the baseline's
        RunResidual& run = joint.runs()[r];
        if (run.takes_small_steps(joint.theta(r)) || trial.variance[r] > nearly_explained) find_motion(run, joint.theta(r));
      });
    });
    if (!takes_small_steps(joint) && trial.decays.chi2 < nearly_explained) fit_own_parameters(joint, nearly_explained);
  }
  temper(joint);
  measure(trial);
  return helps;
}

namespace {

/// The runs whose motion is estimated, once the decays have told theta under a law with corners: each by itself, for a fit of all of them together loses its way. Decays that are not followed exactly are set aside.
void follow_motions(Trial& trial) {
  JointProblem& joint = trial.arrival.joint;
  const auto moves = [](const RunResidual& run) { return run.motion().unknowns() > 0; };
  if (std::none_of(joint.runs().begin(), joint.runs().end(), moves)) return measure(trial);
  for (RunResidual& run : joint.runs()) run.set_aside(!trial.decays.exactly && !moves(run));
  in_noise_of_decays(trial, [&] { fit_own_parameters(joint); });
  temper(joint);
  measure(trial);
}

}  // namespace

void judge_decays(Trial& trial) {
  if (!any_aside(trial.arrival.joint)) return;
  trial.decays = {left_as_trusted(trial.arrival.joint), false};
  measure(trial);
}

void follow_further(Trial& trial, double least, const Goal& goal) {
  if (decays_decide(trial)) return follow_motions(trial);
  if (fit_towards(goal, trial, 2) && trial.reduced_chi2() < least) fit_fully(trial, 6);
}

bool follow_nonlinear(const FitProblem& problem, Trial& trial, const Trial& base, double least, const Goal& goal) {
  if (all_driven(trial.arrival.joint)) {
    Trial guessed = trial;
    if (fit_decays_first(trial, base, true)) fit_fully(trial, 2);
    if (leaves_nothing(trial)) return true;
    fit_from_first_guesses(problem, guessed);
    if (guessed.excess() < trial.excess()) trial = std::move(guessed);
    return true;
  }
  trial.ruled_out = !fit_decays_first(trial, base);
  if (trial.ruled_out) return false;
  follow_further(trial, least, goal);
  return true;
}

Arrival arrive_at_effects(const FitProblem& problem) {
  Trial best = fit_baseline(problem);
  for (const std::vector<std::string>& added : in_order(problem, best.arrival.joint)) {
    std::vector<std::string> at_work = best.effects;
    at_work.insert(at_work.end(), added.begin(), added.end());
    Trial trial = prepare(problem, best, at_work);
    if (!nonlinear(trial)) {
      fit_fully(trial, 2);
    } else if (Trial followed = trial; follow_nonlinear(problem, followed, best, best.reduced_chi2())) {
      trial = std::move(followed);
    } else {
      measure(trial);  // where the law's size went astray it is sought again from where it started
    }
    best = std::move(trial);
  }
  if (leaves_nothing(best) || decays_decide(best)) return best.arrival;
  if (nonlinear(best)) {
    if (!all_driven(best.arrival.joint)) fit_from_first_guesses(problem, best);  // there it has been done
    return best.arrival;
  }
  Trial anew{best.effects, arrive_with_effects(problem, best.arrival)};
  measure(anew);
  return bic_difference(anew, best) < 0 ? anew.arrival : best.arrival;
}

void fit_from_first_guesses(const FitProblem& problem, Trial& trial) {
  const ArrivalEffort effort{false, 10, 0.5, 15};
  Trial other{trial.effects, arrive_with_effects(problem, trial.arrival, effort), trial.promised_left, trial.score};
  temper(other.arrival.joint);
  anneal(other.arrival, 5, {});
  measure(other);
  if (trial.variance.empty() || bic_difference(other, trial) < 0) trial = std::move(other);
}

}  // namespace unrig
