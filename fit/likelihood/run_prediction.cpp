#include <cmath>

#include "core/propagate/nonlinear_response.h"
#include "fit/likelihood/run_linearised.h"
#include "fit/likelihood/wandering_force.h"

// What RunResidual predicts of a whole record, and how that follows theta and the noise.

namespace unrig {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

RunResidual::Prediction RunResidual::predict(const VectorXd& theta) const {
  const Solution solution = solve(theta);
  const Linearised& lin = *solution.model;
  Prediction p;
  p.channels = channels_;
  const bool finite = std::isfinite(solution.chi2);  // else the model runs away from wherever c was looked for
  p.linear = finite ? solution.linear : (motion_.unknowns() > 0 ? as_the_angle_says() : VectorXd::Zero(unknowns_));
  const Index behind = unknowns_ - motion_.unknowns();
  p.factor_behind_motion = MatrixXd::Zero(behind, behind);
  if (finite) p.factor_behind_motion = lin.eliminate->last_factor().bottomRightCorner(behind, behind);
  p.offset = p.linear.segment(first_offset_, measured_.cols());
  p.initial_state = p.linear.segment(first_state_, static_cast<Index>(free_.size()));
  if (angle_offset_ >= 0) p.angle_offset = p.linear.segment(angle_offset_, 1);
  if (motion_.unknowns() > 0) p.motion = motion_of(motion_.coefficients(p.linear.head(motion_.unknowns())), run_->dt);
  p.output.setConstant(run_->samples(), measured_.cols(), std::nan(""));
  if (!finite) return p;
  if (!lin.system.feedback.empty()) {
    p.output = follow(lin.system, lin.step, theta, {initial_state(p.linear, lin.system.states()), whole_jerk(p.linear), inputs_, MatrixXd(lin.system.states(), 0), {}}, run_->samples(), Partials::none).output;
    p.output.rowwise() += p.offset.transpose();
    return p;
  }
  // The readings themselves, not behind the filters.
  const bool as_they_are = filters_.empty() && !lin.wandering;
  LinearSystem system = as_they_are ? lin.system : searched_system(theta);
  const ExactStep step = as_they_are ? lin.step : exact_step(system, run_->dt);
  p.output = Linearised::response(*this, system, step, p.linear, p.motion);
  if (lin.known.size() > 0) p.output += lin.known;
  p.output.rowwise() += p.offset.transpose();
  if (lin.wandering) p.output += lin.wandering->foreseen(lin.innovations(*this, p.linear), system.C.value);
  return p;
}

MatrixXd RunResidual::Linearised::response(const RunResidual& run, const LinearSystem& system, const ExactStep& step, const VectorXd& linear, const Motion& motion) {
  const Index samples = run.run_->samples();
  MatrixXd output(samples, system.C.rows());
  DualMatrix state(MatrixXd::Zero(system.states(), 1));
  state.value.col(0) = run.initial_state(linear, system.states());
  const FreeResponse free(system, step, Partials::none);
  for (const MotionBasis::Phase& phase : run.phases_) {
    const Interval& s = phase.samples;
    const Response response = phase.moving ? drive(system, step, state, s.length(), motion.jerk.segment(s.first, s.length()), {}, Partials::none)
                                             : free.from(state, s.length());
    state = response.end;
    if (phase.moving && s.last < samples) stand_still(state.value, system.motion, Eigen::RowVectorXd::Constant(1, motion.angle[s.last] + run.arrival_angle(system)));
    output.middleRows(s.first, s.length()) = response.output;
  }
  return output;
}

/// Adds d prediction / d c of one block, times what c does, to the rows of its samples.
void RunResidual::add_prediction_slope(const Linearised& lin, const run_rows::Block& block, const MatrixXd& linear_slope, MatrixXd& slope) const {
  const Interval& s = block.samples;
  auto own = slope.middleRows(s.first, s.length());
  const MatrixXd offsets = lin.offset_columns(block.channel, s);
  own += offsets * linear_slope.middleRows(lin.offsets_from(*this, block.channel), offsets.cols());
  MatrixXd state = block.start.leftCols(unknowns_) * linear_slope;
  if (block.rows.size() > 0) {
    const Splines splines = splines_in(s);
    const Index acting = block.moving ? splines.all() : 0, states = block.rows.cols() - acting;
    own += block.rows.leftCols(states) * state.topRows(states) + block.rows.rightCols(acting) * linear_slope.middleRows(splines.still, acting);
    return;
  }
  const MatrixXd& free = lin.free[static_cast<std::size_t>(block.channel)].rows;
  if (block.moving) {
    const Splines splines = splines_in(s);
    own += motion_output_columns(lin, block.channel, s, splines) * linear_slope.middleRows(splines.still, splines.all()) + free.topRows(s.length()) * state;
    return;
  }
  for (Index first = 0; first < s.length(); first += rest_rows::stretch_samples, state = lin.leap * state) {
    const Index length = std::min(rest_rows::stretch_samples, s.length() - first);
    own.middleRows(first, length) += free.topRows(length) * state;
  }
}

RunResidual::Sensitivity RunResidual::sensitivity(const VectorXd& theta) const {
  const Solution solution = solve(theta);
  const Linearised& lin = *solution.model;
  const Evaluation e = differentiate(solution);
  const Index parameters = static_cast<Index>(model_->parameters().size()), n = run_->samples();
  // c follows theta; and the first offset, theta held, is (R^T R)^-1 X^T noise in its row, X what c does to the weighted readings.
  MatrixXd moves(unknowns_, parameters + 1);
  moves << e.linear_slope, lin.eliminate->covariance_column(first_offset_);
  Sensitivity result;
  result.channels.assign(static_cast<std::size_t>(measured_.cols()), {VectorXd::Zero(n), MatrixXd::Zero(n, parameters + 1)});
  follow_partials(theta, solution.linear, {}, [&](std::size_t block, const Interval& s, const MatrixXd& m) {
    Sensitivity::PerChannel& channel = result.channels[block % result.channels.size()];
    channel.residual.segment(s.first, s.length()) = -m.col(parameters);
    channel.slope.block(s.first, 0, s.length(), parameters) = m.leftCols(parameters);
  });
  for (const run_rows::Block& block : lin.blocks) add_prediction_slope(lin, block, moves, result.channels[static_cast<std::size_t>(block.channel)].slope);
  const bool coloured = lin.noise != nullptr;
  if (coloured) lin.whiten(*this, theta, result);
  for (Index c = 0; c < measured_.cols() && !coloured; ++c) {
    Sensitivity::PerChannel& channel = result.channels[static_cast<std::size_t>(c)];
    channel.residual = weight_.col(c).cwiseProduct(channel.residual + lin.readings(*this).col(c));
    channel.slope.array().colwise() *= weight_.col(c).array();
  }
  if (angle_offset_ >= 0) {
    Sensitivity::PerChannel angle{VectorXd(n), MatrixXd(n, parameters + 1)};
    for (const MotionBasis::Phase& phase : phases_) {
      const Interval& s = phase.samples;
      const MatrixXd columns = motion_.angle_columns(phase.moving ? s : Interval{s.first, s.first + 1});  // one row for a whole rest
      const VectorXd predicted = (columns * e.linear.head(motion_.unknowns())).array() + e.linear[angle_offset_];
      MatrixXd slope = columns * moves.topRows(motion_.unknowns());
      slope.rowwise() += moves.row(angle_offset_);
      const Index times = phase.moving ? 1 : s.length();
      angle.residual.segment(s.first, s.length()) = predicted.replicate(times, 1);
      angle.slope.middleRows(s.first, s.length()) = slope.replicate(times, 1);
    }
    angle.residual = angle_weight_.cwiseProduct(angle_ - angle.residual);
    angle.slope.array().colwise() *= angle_weight_.array();
    result.channels.push_back(std::move(angle));
  }
  for (Sensitivity::PerChannel& channel : result.channels) {
    channel.into_offset = channel.slope.rightCols(1);
    channel.slope.conservativeResize(n, parameters);
  }
  return result;
}

RunResidual::Levels RunResidual::levels(const Solution& solution) const {
  const Index count = unknowns_ - first_offset_;  // they come last
  return {solution.linear.tail(count), solution.model->eliminate->last_factor().bottomRightCorner(count, count)};
}

MatrixXd RunResidual::linear_factor(const Solution& solution) const {
  return std::isfinite(solution.chi2) ? solution.model->eliminate->factor() : MatrixXd::Zero(unknowns_, unknowns_);
}

}  // namespace unrig
