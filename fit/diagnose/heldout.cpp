#include "fit/diagnose/heldout.h"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>

#include "fit/search/find_motion.h"
#include "fit/search/search_numbers.h"
#include "fit/uncertainty/undetermined.h"

namespace unrig {

using Eigen::Index;
using Eigen::MatrixXd;
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

/// What the runs of `fit` tell of the unknowns that all runs share, for those of another run that are `open`: their residual to first order, all else eliminated.
ResidualTerm told_by(const JointProblem& fit, const JointProblem& other, const std::vector<std::size_t>& open) {
  const JointProblem::Linearisation lin = fit.linearise();
  const Index of_runs = lin.residual.size() - lin.beside_runs_rows, count = static_cast<Index>(open.size());
  std::vector<Index> columns, shared;
  for (std::size_t i = 0; i < fit.unknowns().size(); ++i)
    if (const Unknown& u = fit.unknowns()[i]; !u.held) (u.run < 0 ? shared : columns).push_back(static_cast<Index>(i));
  columns.insert(columns.end(), shared.begin(), shared.end());
  const auto width = static_cast<Index>(columns.size());
  MatrixXd rows = MatrixXd::Zero(of_runs + width, width + 1);
  rows.topLeftCorner(of_runs, width) = lin.jacobian.topRows(of_runs)(Eigen::all, columns);
  rows.col(width).head(of_runs) = lin.residual.head(of_runs);
  const MatrixXd triangle = Eigen::HouseholderQR<MatrixXd>(rows).matrixQR().topRows(width).triangularView<Eigen::Upper>();
  VectorXd there(count);
  for (Index k = 0; k < count; ++k) there[k] = other.unknowns()[open[static_cast<std::size_t>(k)]].value;
  return {open, count, [factor = MatrixXd(triangle.block(width - count, width - count, count, count)), left = VectorXd(triangle.col(width).tail(count)), there](const VectorXd& values, VectorXd& residual, MatrixXd* slope) {
            residual = left + factor * (values - there);
            if (slope != nullptr) *slope = factor;
            return true;
          }};
}

/// Holds what all runs share where the fit has it or, where numbers of the files are uncertain, leaves it as open as the fit does: such numbers are known by all runs together, and what a run alone tells of them no other
/// predicts.
JointProblem::SolveOptions as_known_by(const JointProblem& fit, JointProblem& joint) {
  JointProblem::SolveOptions options;
  const bool exact = joint.model().rig().deviations == 0;
  std::vector<std::size_t> open;
  for (std::size_t i = 0; i < joint.unknowns().size(); ++i) {
    Unknown& u = joint.unknowns()[i];
    if (u.run >= 0) continue;
    const bool is_free = std::any_of(fit.unknowns().begin(), fit.unknowns().end(), [&](const Unknown& known) { return known.run < 0 && known.parameter == u.parameter && !known.held; });
    u.held = exact || !is_free;
    if (!u.held) open.push_back(i);
  }
  if (!open.empty()) options.beside.push_back(told_by(fit, joint, open));
  return options;
}

/// What is left of the one run of `joint` once all that is free has been fitted, from where its motion stands.
HeldoutResidual left_of(JointProblem joint, JointProblem::SolveOptions options) {
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
  for (Unknown& u : joint.unknowns()) u.value = nearest_value(arrival.joint, u, joint.runs().front().conditions().onset_angle);
  JointProblem::SolveOptions options = as_known_by(arrival.joint, joint);
  RunResidual& residual = joint.runs().front();
  residual.follow_in(arrival.joint.runs().front().finer());
  find_motion(residual, joint.theta(0));
  return left_of(std::move(joint), std::move(options));
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
  for (Unknown& u : joint.unknowns())
    if (u.run < 0) u.value = nearest_value(without.joint, u, 0);
  JointProblem::SolveOptions as_known = as_known_by(without.joint, joint);
  joint.runs().front().temper(1);
  return left_of(std::move(joint), std::move(as_known));
}

}  // namespace unrig
