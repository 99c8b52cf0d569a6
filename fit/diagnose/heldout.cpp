#include "fit/diagnose/heldout.h"

#include <algorithm>
#include <cmath>

#include "fit/search/find_motion.h"
#include "fit/search/search_numbers.h"
#include "fit/uncertainty/undetermined.h"

namespace unrig {

using Eigen::Index;
using Eigen::VectorXd;

namespace {

/// Of a parameter of all runs its value; of one of a single run (the slope of the normal force) that of the run that began at the angle nearest to `onset`.
double nearest_value(const JointProblem& fitted, const Unknown& wanted, double onset) {
  double value = wanted.value, nearest = INFINITY;
  for (const Unknown& known : fitted.unknowns()) {
    if (known.parameter != wanted.parameter || (known.run < 0) != (wanted.run < 0)) continue;
    const double away = known.run < 0 ? 0 : std::abs(fitted.runs()[static_cast<std::size_t>(known.run)].conditions().onset_angle - onset);
    if (away < nearest) value = known.value;
    nearest = std::min(nearest, away);
  }
  return value;
}

/// What is left of the one run of `joint` once all that is free has been fitted, from where its motion stands.
HeldoutResidual left_of(JointProblem joint) {
  JointProblem::SolveOptions options;
  options.iterations = 12;
  options.tolerance = 1e-4;
  options.precision = 0.1;  // what is predicted moves by less than its own noise
  options.most_evaluations = 15;
  RunResidual& residual = joint.runs().front();
  if (residual.takes_small_steps(joint.theta(0))) options.enough = to_the_noise;  // slopes at corners promise more than steps keep
  joint.solve(options);
  constexpr double followed = 1.5;
  if (joint.chi2() > followed * static_cast<double>(residual.degrees_of_freedom()) && find_motion(residual, joint.theta(0), true)) joint.solve(options);
  if (residual.reject_spikes(joint.theta(0)) > 0) joint.solve(options);
  const RunResidual::Prediction p = residual.predict(joint.theta(0));
  const VectorXd weight = residual.channel_weight(0), left = residual.run().channel(p.channels.front()).value - p.output.col(0);
  HeldoutResidual result{p.channels.front()};
  double sum = 0, count = 0;
  for (Index k = 0; k < left.size(); ++k)
    if (weight[k] > 0 && std::isfinite(left[k])) sum += left[k] * left[k], ++count;
  result.rms = p.output.allFinite() ? std::sqrt(sum / std::max(1.0, count)) : INFINITY;  // a model that runs away predicts nothing
  result.noise = residual.noise(0);
  return result;
}

}  // namespace

HeldoutResidual predict_heldout(const Arrival& arrival, const Run& run) {
  const auto windows = windows_to_fit(run);
  std::vector<RunResidual> one;
  RunOptions begins;
  begins.free_memories = run.kind == RunKind::forced || run.kind == RunKind::moved;
  one.emplace_back(*arrival.model, run, windows, begins);
  JointProblem joint(*arrival.model, std::move(one));
  for (Unknown& u : joint.unknowns()) {
    u.held = u.run < 0;
    u.value = nearest_value(arrival.joint, u, joint.runs().front().conditions().onset_angle);
  }
  RunResidual& residual = joint.runs().front();
  residual.follow_in(arrival.joint.runs().front().finer());
  find_motion(residual, joint.theta(0));
  return left_of(std::move(joint));
}

HeldoutResidual predict_left_out(const Arrival& arrival, std::size_t run) {
  const JointProblem& all = arrival.joint;
  std::vector<std::size_t> others;
  for (std::size_t r = 0; r < all.runs().size(); ++r)
    if (r != run) others.push_back(r);
  Arrival without{arrival.model, {}, all.part(others)};
  for (Unknown& u : without.joint.unknowns()) u.held = false;
  hold_undetermined(without.joint);  // the run may have been the only one that tells
  JointProblem::SolveOptions options;
  options.iterations = 12;
  options.tolerance = 1e-4;
  options.precision = 0.3;
  options.most_evaluations = 15;
  solve(without, options);
  JointProblem joint = all.part({run});
  for (Unknown& u : joint.unknowns()) {
    u.held = u.run < 0;
    if (u.held) u.value = nearest_value(without.joint, u, 0);
  }
  joint.runs().front().temper(1);
  return left_of(std::move(joint));
}

}  // namespace unrig
