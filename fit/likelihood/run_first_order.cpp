#include "fit/likelihood/run_first_order.h"

#include <algorithm>
#include <cmath>

#include "core/propagate/nonlinear_response.h"

namespace unrig {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Rows over the samples of all channels, one channel after the other, in units of the noise; then those of the angle, which are zero.
MatrixXd RunResidual::FirstOrder::weighted(const MatrixXd& rows) const {
  MatrixXd all = MatrixXd::Zero(rows.rows() + angle_left_.size(), rows.cols());
  auto readings = all.topRows(rows.rows());
  if (model_->noise) {
    readings = model_->white(run_, rows);
    return all;
  }
  const Index samples = run_.last_sample_;
  for (Index c = 0; c < run_.measured_.cols(); ++c) readings.middleRows(c * samples, samples) = run_.weight_.col(c).head(samples).asDiagonal() * rows.middleRows(c * samples, samples);
  return all;
}

/// What is left of such rows when c follows.
MatrixXd RunResidual::FirstOrder::beside_c(const MatrixXd& rows) const {
  const MatrixXd rotated = columns_->rotated(rows);
  return rotated.bottomRows(rotated.rows() - columns_->rank());
}

RunResidual::FirstOrder::FirstOrder(const RunResidual& run, const VectorXd& theta) : run_(run) {
  const Solution solution = run.solve(theta);
  model_ = solution.model;
  if (!std::isfinite(solution.chi2) || model_->wandering) return;
  linear_ = solution.linear;
  const Index samples = run.last_sample_, channels = run.measured_.cols(), parameters = static_cast<Index>(run.model_->parameters().size()), unknowns = run.unknowns_;
  std::vector<MatrixXd> in_c(static_cast<std::size_t>(channels), MatrixXd::Zero(samples, unknowns));
  for (const run_rows::Block& block : model_->blocks) run.add_prediction_slope(*model_, block, MatrixXd::Identity(unknowns, unknowns), in_c[static_cast<std::size_t>(block.channel)]);
  MatrixXd rows(channels * samples, parameters + unknowns + 1);  // [in theta | in c | left]
  run.follow_partials(theta, linear_, {}, [&](std::size_t block, const Interval& s, const MatrixXd& m) {
    const auto c = static_cast<Index>(block) % channels;
    auto own = rows.middleRows(c * samples + s.first, s.length());
    own.leftCols(parameters) = m.leftCols(parameters);
    own.rightCols(1) = run.readings().col(c).segment(s.first, s.length()) - m.col(parameters);
  });
  for (Index c = 0; c < channels; ++c) rows.middleRows(c * samples, samples).middleCols(parameters, unknowns) = in_c[static_cast<std::size_t>(c)];
  const MatrixXd angle = run.angle_rows();
  angle_left_ = angle.col(unknowns) - angle.leftCols(unknowns) * linear_;
  if (model_->noise) {  // theta moves the filter too
    MatrixXd white = MatrixXd::Zero(rows.rows() + angle.rows(), rows.cols());
    rows.leftCols(parameters) *= -1;
    white.topRows(rows.rows()) = model_->white_slopes(run, theta, std::move(rows));
    white.leftCols(parameters) *= -1;
    rows = std::move(white);
  } else {
    rows = weighted(rows);
  }
  rows.bottomRows(angle.rows()).middleCols(parameters, unknowns) = angle.leftCols(unknowns);
  rows.bottomRows(angle.rows()).rightCols(1) = angle_left_;
  columns_ = std::make_shared<const run_rows::Eliminator>(rows.middleCols(parameters, unknowns));
  in_theta_ = Householder(beside_c(rows.leftCols(parameters)));
  const VectorXd left = in_theta_.rotated(beside_c(rows.rightCols(1)));
  const MatrixXd triangle = in_theta_.triangle();
  slopes_ = MatrixXd::Zero(triangle.rows() + 1, parameters);
  slopes_.topRows(triangle.rows()) = triangle;
  left_.resize(triangle.rows() + 1);
  left_ << left.head(triangle.rows()), left.tail(left.size() - triangle.rows()).norm();
}

VectorXd RunResidual::FirstOrder::as_other_has_it(const RunResidual& run, const VectorXd& linear, const RunResidual& other) {
  VectorXd c = VectorXd::Zero(other.unknowns_);
  c.head(run.motion_.unknowns()) = linear.head(run.motion_.unknowns());
  const Index behind = run.unknowns_ - run.first_offset_;
  c.tail(behind) = linear.tail(behind);
  for (std::size_t i = 0; i < run.free_.size(); ++i) {
    const bool is_of_model = run.free_[i] < run.states_;
    const Index state = is_of_model ? run.free_[i] : run.free_[i] - run.states_ + other.states_;  // filters stand behind the model's states
    const auto there = std::find(other.free_.begin(), other.free_.end(), state);
    if (there != other.free_.end() && is_of_model == (state < other.states_)) c[other.first_state_ + (there - other.free_.begin())] = linear[run.first_state_ + static_cast<Index>(i)];
  }
  return c;
}

void RunResidual::FirstOrder::start(RunResidual& other, const RunResidual& run) {
  const bool is_alike = run.motion_.unknowns() == other.motion_.unknowns() && run.unknowns_ - run.first_offset_ == other.unknowns_ - other.first_offset_;
  if (is_alike && run.last_linear_.size() == run.unknowns_) other.start_from(as_other_has_it(run, run.last_linear_, other));
}

RunResidual::FirstOrder::Beside RunResidual::FirstOrder::beside(const RunResidual& other, const VectorXd& theta, const std::vector<Index>& parameters, const VectorXd& begins) const {
  const LinearSystem system = other.differentiable_system(theta, parameters);
  const Partials partials = parameters.empty() ? Partials::none : Partials::all;
  const Index n = system.states(), samples = run_.last_sample_, channels = run_.measured_.cols(), own = static_cast<Index>(parameters.size());
  const Index all = partials == Partials::none ? 0 : static_cast<Index>(other.model_->parameters().size());
  std::vector<Index> further;
  for (const Index state : other.free_)
    if (state >= run_.states_ && state < other.states_) further.push_back(state);
  const auto count = static_cast<Index>(further.size());
  VectorXd linear = as_other_has_it(run_, linear_, other);
  for (Index i = 0; i < begins.size(); ++i) linear[other.first_state_ + (std::find(other.free_.begin(), other.free_.end(), further[static_cast<std::size_t>(i)]) - other.free_.begin())] = begins[i];
  NonlinearDrive from{other.initial_state(linear, n), other.whole_jerk(linear), other.inputs_, MatrixXd::Zero(n, count), {}};
  MatrixXd start = MatrixXd::Zero(n + other.filter_states(), count + all);
  for (Index i = 0; i < count; ++i) from.start_tangent(further[static_cast<std::size_t>(i)], i) = start(further[static_cast<std::size_t>(i)], i) = 1;
  NonlinearResponse response = follow(system, step_to_follow(system, other.run_->dt), theta, from, samples, partials);
  Beside result;
  result.left = VectorXd::Constant(1, INFINITY);
  if (!response.finite) return result;
  const Index new_laws = response.largest_argument.size() - static_cast<Index>(model_->system.feedback.size());
  if (new_laws > 0) result.largest_argument = response.largest_argument.tail(new_laws).maxCoeff();
  FilterStates filters = other.filters_at(other.initial_state(linear, n + other.filter_states())), filter_tangents = other.filters_at(start);
  MatrixXd rows(channels * samples, own + count + 1);
  for (Index c = 0; c < channels; ++c) {
    const auto channel = static_cast<std::size_t>(c);
    MatrixXd& tangent = response.tangent[channel];
    other.filter_outputs(channel, response.output.col(c), filters);
    other.filter_outputs(channel, tangent, filter_tangents);
    auto of_channel = rows.middleRows(c * samples, samples);
    for (Index j = 0; j < own; ++j) of_channel.col(j) = tangent.col(count + parameters[static_cast<std::size_t>(j)]);
    of_channel.middleCols(own, count) = tangent.leftCols(count);
    of_channel.rightCols(1) = (run_.readings().col(c).head(samples) - response.output.col(c)).array() - linear[other.first_offset_ + c];
  }
  rows = weighted(rows);
  rows.bottomRows(angle_left_.size()).rightCols(1) = angle_left_;
  const MatrixXd rotated = in_theta_.rotated(beside_c(rows));
  const Index reached = slopes_.rows() - 1, known = slopes_.cols();
  const MatrixXd rest = run_rows::compress(rotated.bottomRows(rotated.rows() - reached));
  result.slopes = MatrixXd::Zero(reached + rest.rows(), known + own + count);
  result.slopes.topLeftCorner(reached, known) = slopes_.topRows(reached);
  result.slopes.topRightCorner(reached, own + count) = rotated.topLeftCorner(reached, own + count);
  result.slopes.bottomRightCorner(rest.rows(), own + count) = rest.leftCols(own + count);
  result.left.resize(result.slopes.rows());
  result.left << rotated.col(own + count).head(reached), rest.col(own + count);
  return result;
}

}  // namespace unrig
