#include <algorithm>
#include <cmath>

#include "core/nonlinear_response.h"
#include "fit/run_linearised.h"

// The arithmetic behind RunResidual: rows of the linear unknowns, their elimination, and what theta does beside them.

namespace unrig {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::RowVectorXd;
using Eigen::VectorXd;

using run_rows::compress;
using run_rows::stacked;

namespace {

MatrixXd power(MatrixXd base, Index exponent) {
  MatrixXd result = MatrixXd::Identity(base.rows(), base.cols());
  for (; exponent > 0; exponent /= 2) {
    if (exponent % 2 == 1) result = result * base;
    base = base * base;
  }
  return result;
}

}  // namespace

VectorXd RunResidual::initial_state(const VectorXd& linear, Index states) const {
  VectorXd state = VectorXd::Zero(states);
  for (std::size_t i = 0; i < free_.size(); ++i) state[free_[i]] = linear[first_state_ + static_cast<Index>(i)];
  return state;
}

Interval RunResidual::counted(const Segment& segment) const { return {segment.samples.first, std::min(segment.samples.last, last_sample_)}; }

std::shared_ptr<RunResidual::Linearised> RunResidual::linearise(const VectorXd& theta) const {
  auto lin = std::make_shared<Linearised>();
  lin->system = model_->system(conditions_, theta, channels_);
  for (DualMatrix* m : {&lin->system.A, &lin->system.B, &lin->system.C, &lin->system.D}) m->partial.clear();
  lin->step = exact_step(lin->system, run_->dt);
  if (lin->system.feedback.empty()) prepare_linear(*lin);
  return lin;
}

/// Responses that the rows of a linear system are made of.
void RunResidual::prepare_linear(Linearised& lin) const {
  if (inputs_.cols() > 0)
    lin.known = drive(lin.system, lin.step, DualMatrix(MatrixXd::Zero(lin.system.states(), 1)), run_->samples(), {}, inputs_, Partials::none).output;
  Index longest = 0, last_motion = 0;
  for (const Segment& s : segments_) {
    if (s.moving) last_motion = s.samples.last;
    if (!s.moving || !free_.empty()) longest = std::max(longest, counted(s).length());
  }
  lin.free = free_response_rows(lin.system, lin.step, longest);
  if (motion_.unknowns() > 0) {
    lin.spline = spline_states(lin.step, last_motion + 1 - motion_.columns().front().first);
    lin.spline_summed = lin.spline;
    for (Index k = 1; k < lin.spline.cols(); ++k) lin.spline_summed.col(k) += lin.spline_summed.col(k - 1);
  }
}

/// d output / d motion unknowns over a segment in which the shaft moves: the response to one spline, shifted.
MatrixXd RunResidual::motion_output_columns(const Linearised& lin, Index channel, const Interval& samples) const {
  const RowVectorXd unit = lin.system.C.value.row(channel) * lin.spline, summed = lin.system.C.value.row(channel) * lin.spline_summed;
  MatrixXd columns = MatrixXd::Zero(samples.length(), motion_.unknowns());
  for (Index j = 0; j < motion_.unknowns(); ++j) {
    const MotionBasis::Column& column = motion_.columns()[static_cast<std::size_t>(j)];
    const auto add = [&](const RowVectorXd& response, Index knot, double amount) {
      const Index from = std::max(samples.first, knot + 1);
      if (amount == 0 || from >= samples.last) return;
      columns.col(j).tail(samples.last - from) += amount * response.segment(from - knot, samples.last - from).transpose();
    };
    for (Index i = 0; i < column.value.size(); ++i) add(unit, column.first + i, column.value[i]);
    add(summed, column.first + column.value.size(), column.tail);
  }
  return columns;
}

/// d state / d motion unknowns at `sample`.
MatrixXd RunResidual::motion_state_columns(const Linearised& lin, Index sample) const {
  MatrixXd columns = MatrixXd::Zero(lin.spline.rows(), motion_.unknowns());
  for (Index j = 0; j < motion_.unknowns(); ++j) {
    const MotionBasis::Column& column = motion_.columns()[static_cast<std::size_t>(j)];
    for (Index i = 0; i < column.value.size(); ++i) {
      const Index since = sample - column.first - i;
      if (since <= 0) break;
      columns.col(j) += column.value[i] * lin.spline.col(since);
    }
    const Index since_tail = sample - column.first - column.value.size();
    if (column.tail != 0 && since_tail > 0) columns.col(j) += column.tail * lin.spline_summed.col(since_tail);
  }
  return columns;
}

/// d state / d c at the first sample of a segment.
MatrixXd RunResidual::segment_start(const Linearised& lin, const Interval& samples) const {
  MatrixXd start = MatrixXd::Zero(lin.system.states(), unknowns_);
  if (motion_.unknowns() > 0) start.leftCols(motion_.unknowns()) = motion_state_columns(lin, samples.first);
  if (free_.empty()) return start;
  const MatrixXd since = samples.first == 0 ? MatrixXd::Identity(lin.system.states(), lin.system.states()) : power(lin.step.transition.value, samples.first);
  for (std::size_t i = 0; i < free_.size(); ++i) start.col(first_state_ + static_cast<Index>(i)) = since.col(free_[i]);
  return start;
}

/// All rows [c | y], those of segments at rest rotated and cut to what c can reach; solves for c.
void RunResidual::stack_rows(Linearised& lin) const {
  std::vector<MatrixXd> rows;
  double unreachable = 0;
  for (const Segment& segment : segments_) {
    const Interval s = counted(segment);
    const Index length = s.length();
    if (length <= 0) break;
    const MatrixXd start = segment.moving ? MatrixXd() : segment_start(lin, s);
    for (Index c = 0; c < measured_.cols(); ++c) {
      const auto w = weight_.col(c).segment(s.first, length);
      VectorXd y = measured_.col(c).segment(s.first, length);
      if (lin.known.size() > 0) y -= lin.known.col(c).segment(s.first, length);
      y = w.cwiseProduct(y);
      Linearised::Block block{s, segment.moving, c, length, nullptr, {}, {}};
      MatrixXd reach;
      if (segment.moving) {
        reach = MatrixXd::Zero(length, unknowns_);
        reach.leftCols(motion_.unknowns()) = motion_output_columns(lin, c, s);
        if (!free_.empty()) reach.middleCols(first_state_, static_cast<Index>(free_.size())) = lin.free[static_cast<std::size_t>(c)].topRows(length) * segment_start(lin, s).middleCols(first_state_, static_cast<Index>(free_.size()));
        reach.col(first_offset_ + c).setOnes();
        reach = w.asDiagonal() * reach;
      } else {
        reach = block.rotate(w, lin.free[static_cast<std::size_t>(c)].topRows(length), start, first_offset_ + c);
      }
      const auto [reached, others] = block.split(std::move(y));
      unreachable += others.squaredNorm();
      MatrixXd together(reach.rows(), unknowns_ + 1);
      together << reach, reached;
      rows.push_back(std::move(together));
      lin.blocks.push_back(std::move(block));
    }
  }
  rows.insert(rows.end(), angle_rows_.begin(), angle_rows_.end());
  lin.settle(rows, unknowns_, unreachable);
}

RunResidual::Solution RunResidual::solve(const VectorXd& theta) const {
  const std::shared_ptr<Linearised> lin = linearise(theta);
  if (lin->system.feedback.empty())
    stack_rows(*lin);
  else
    solve_nonlinear(*lin, theta);
  return {theta, lin->chi2, lin->linear, lin};
}

LinearSystem RunResidual::differentiable_system(const VectorXd& theta) const {
  LinearSystem system = model_->system(conditions_, theta, channels_);
  if (differentiated_.empty()) return system;
  for (DualMatrix* m : {&system.A, &system.B, &system.C, &system.D})
    for (Index j = 0; j < m->parameters(); ++j)
      if (std::find(differentiated_.begin(), differentiated_.end(), j) == differentiated_.end()) m->partial[static_cast<std::size_t>(j)].resize(0, 0);
  return system;
}

namespace {

/// What the parameters do to one channel over a segment at fixed c, beside its prediction: [d y / d theta | y].
MatrixXd slopes_and_prediction(const Response& response, const Response& known, const Interval& s, Index channel, Index parameters) {
  MatrixXd m = MatrixXd::Zero(s.length(), parameters + 1);
  m.col(parameters) = response.output.col(channel);
  if (known.output.size() > 0) m.col(parameters) += known.output.col(channel).segment(s.first, s.length());
  for (Index j = 0; j < parameters; ++j) {
    const auto index = static_cast<std::size_t>(j);
    if (index < response.partial.size() && response.partial[index].size() > 0) m.col(j) += response.partial[index].col(channel);
    if (index < known.partial.size() && known.partial[index].size() > 0) m.col(j) += known.partial[index].col(channel).segment(s.first, s.length());
  }
  return m;
}

}  // namespace

/// Follows the model with its partials through all segments at fixed c, and hands [d y / d theta | y] of each channel and segment to `take`.
void RunResidual::follow_partials(const VectorXd& theta, const VectorXd& linear, const TakeRows& take) const {
  const LinearSystem system = differentiable_system(theta);
  if (!system.feedback.empty()) return follow_nonlinear_partials(system, theta, linear, take);
  const ExactStep step = exact_step(system, run_->dt);
  const auto parameters = static_cast<Index>(model_->parameters().size());
  Response known;
  if (inputs_.cols() > 0) known = drive(system, step, DualMatrix(MatrixXd::Zero(system.states(), 1)), run_->samples(), {}, inputs_, Partials::all);
  DualMatrix state(MatrixXd::Zero(system.states(), 1), parameters);
  state.value.col(0) = initial_state(linear, system.states());
  VectorXd jerk;
  if (motion_.unknowns() > 0) jerk = motion_of(motion_.coefficients(linear.head(motion_.unknowns())), run_->dt).jerk;
  for (const Segment& segment : segments_) {
    const Interval s = counted(segment);
    if (s.length() <= 0) break;
    const Response response = segment.moving ? drive(system, step, state, s.length(), jerk.segment(s.first, s.length()), {}, Partials::all)
                                             : coast(system, step, state, s.length(), Partials::all);
    state = response.end;
    for (Index c = 0; c < measured_.cols(); ++c) {
      MatrixXd m = slopes_and_prediction(response, known, s, c, parameters);
      m.col(parameters).array() += linear[first_offset_ + c];
      take(s, c, std::move(m));
    }
  }
}

RunResidual::Evaluation RunResidual::differentiate(const Solution& solution) const {
  const Linearised& lin = solution.model->tangents ? *solution.model->tangents : *solution.model;
  const auto parameters = static_cast<Index>(model_->parameters().size());
  std::vector<MatrixXd> reached, others;
  std::size_t next = 0;
  follow_partials(solution.theta, solution.linear, [&](const Interval& s, Index c, MatrixXd m) {
    // Residual and its derivative, weighted: [-d y / d theta | measured - y].
    m = -m;
    m.col(parameters) += measured_.col(c).segment(s.first, s.length());
    auto [top, bottom] = lin.blocks[next++].split(weight_.col(c).segment(s.first, s.length()).asDiagonal() * m);
    reached.push_back(std::move(top));
    if (bottom.rows() > 0) others.push_back(compress(std::move(bottom)));
  });
  for (const MatrixXd& rows : angle_rows_) {
    MatrixXd m = MatrixXd::Zero(rows.rows(), parameters + 1);
    m.col(parameters) = rows.col(unknowns_) - rows.leftCols(unknowns_) * solution.linear;
    reached.push_back(std::move(m));
  }
  const MatrixXd rotated = lin.eliminate->rotated(stacked(reached, parameters + 1));
  const Index rank = lin.eliminate->rank();
  others.push_back(rotated.bottomRows(rotated.rows() - rank));
  const MatrixXd triangle = compress(stacked(others, parameters + 1));

  Evaluation e;
  e.linear = solution.linear;
  e.linear_factor = lin.eliminate->factor();
  e.linear_slope = lin.eliminate->solve(rotated.leftCols(parameters));
  e.residual = VectorXd::Zero(parameters + 1);
  e.jacobian = MatrixXd::Zero(parameters + 1, parameters);
  e.jacobian.topRows(triangle.rows()) = triangle.leftCols(parameters);
  e.residual.head(triangle.rows()) = triangle.col(parameters);
  e.chi2 = e.residual.squaredNorm();
  if (!solution.model->system.feedback.empty()) guide_ = {solution.theta, e.linear, e.linear_slope, solution.chi2};
  return e;
}

RunResidual::Evaluation RunResidual::evaluate(const VectorXd& theta, Partials partials) const {
  const Solution solution = solve(theta);
  if (partials == Partials::all) return differentiate(solution);
  const auto parameters = static_cast<Index>(model_->parameters().size());
  Evaluation e;
  e.chi2 = solution.chi2;
  e.residual = VectorXd::Zero(parameters + 1);
  e.residual[parameters] = std::sqrt(e.chi2);
  e.linear = solution.linear;
  return e;
}

RunResidual::Prediction RunResidual::predict(const VectorXd& theta) const {
  const Solution solution = solve(theta);
  const Linearised& lin = *solution.model;
  Prediction p;
  p.channels = channels_;
  p.linear = solution.linear;
  p.linear_factor = (lin.tangents ? *lin.tangents : lin).eliminate->factor();
  p.offset = p.linear.segment(first_offset_, measured_.cols());
  p.initial_state = p.linear.segment(first_state_, static_cast<Index>(free_.size()));
  if (angle_offset_ >= 0) p.angle_offset = p.linear.segment(angle_offset_, 1);
  if (motion_.unknowns() > 0) p.motion = motion_of(motion_.coefficients(p.linear.head(motion_.unknowns())), run_->dt);
  p.output.resize(run_->samples(), measured_.cols());
  if (!lin.system.feedback.empty()) {
    p.output = follow(lin.system, lin.step, theta, {initial_state(p.linear, lin.system.states()), whole_jerk(p.linear), inputs_, MatrixXd(lin.system.states(), 0), {}}, run_->samples(), Partials::none).output;
    p.output.rowwise() += p.offset.transpose();
    return p;
  }
  DualMatrix state(MatrixXd::Zero(lin.system.states(), 1));
  state.value.col(0) = initial_state(p.linear, lin.system.states());
  for (const Segment& segment : segments_) {
    const Interval& s = segment.samples;
    const Response response = segment.moving ? drive(lin.system, lin.step, state, s.length(), p.motion.jerk.segment(s.first, s.length()), {}, Partials::none)
                                             : coast(lin.system, lin.step, state, s.length(), Partials::none);
    state = response.end;
    p.output.middleRows(s.first, s.length()) = response.output;
  }
  if (lin.known.size() > 0) p.output += lin.known;
  p.output.rowwise() += p.offset.transpose();
  return p;
}

/// d prediction / d c of one block, times what c does.
MatrixXd RunResidual::prediction_slope(const Linearised& lin, std::size_t index, const MatrixXd& linear_slope) const {
  const Linearised::Block& block = lin.blocks[index];
  const Interval& s = block.samples;
  const auto count = static_cast<Index>(free_.size());
  MatrixXd slope;
  if (block.rows.size() > 0) {
    slope = block.moving ? MatrixXd(block.rows * linear_slope) : MatrixXd(block.rows * (block.start * linear_slope));
    if (block.moving) return slope;  // the offset is among the columns
  } else if (block.moving) {
    slope = motion_output_columns(lin, block.channel, s) * linear_slope.topRows(motion_.unknowns());
    if (count > 0)
      slope += lin.free[static_cast<std::size_t>(block.channel)].topRows(s.length()) *
               (segment_start(lin, s).middleCols(first_state_, count) * linear_slope.middleRows(first_state_, count));
  } else {
    slope = lin.free[static_cast<std::size_t>(block.channel)].topRows(s.length()) * (segment_start(lin, s) * linear_slope);
  }
  slope.rowwise() += linear_slope.row(first_offset_ + block.channel);
  return slope;
}

RunResidual::Sensitivity RunResidual::sensitivity(const VectorXd& theta) const {
  const Solution solution = solve(theta);
  const Linearised& lin = solution.model->tangents ? *solution.model->tangents : *solution.model;
  const Evaluation e = differentiate(solution);
  const auto parameters = static_cast<Index>(model_->parameters().size());
  const Index n = run_->samples();
  Sensitivity result;
  result.channels.assign(static_cast<std::size_t>(measured_.cols()), {VectorXd::Zero(n), MatrixXd::Zero(n, parameters)});
  std::size_t next = 0;
  follow_partials(theta, solution.linear, [&](const Interval& s, Index c, MatrixXd m) {
    m.leftCols(parameters) += prediction_slope(lin, next++, e.linear_slope);  // c follows theta
    m.col(parameters) = measured_.col(c).segment(s.first, s.length()) - m.col(parameters);
    const MatrixXd weighted = weight_.col(c).segment(s.first, s.length()).asDiagonal() * m;
    result.channels[static_cast<std::size_t>(c)].residual.segment(s.first, s.length()) = weighted.col(parameters);
    result.channels[static_cast<std::size_t>(c)].slope.middleRows(s.first, s.length()) = weighted.leftCols(parameters);
  });
  if (angle_offset_ >= 0) {
    const MatrixXd columns = motion_.angle_columns({0, n});
    const VectorXd predicted = (columns * e.linear.head(motion_.unknowns())).array() + e.linear[angle_offset_];
    MatrixXd slope = columns * e.linear_slope.topRows(motion_.unknowns());
    slope.rowwise() += e.linear_slope.row(angle_offset_);
    result.channels.push_back({angle_weight_.cwiseProduct(angle_ - predicted), angle_weight_.asDiagonal() * slope});
  }
  return result;
}

MatrixXd RunResidual::linear_rows(const VectorXd& theta) const {
  RunResidual free = *this;
  free.set_motion_prior({});
  const Solution solution = free.solve(theta);
  MatrixXd rows(unknowns_, unknowns_ + 1);
  const Linearised& lin = solution.model->tangents ? *solution.model->tangents : *solution.model;
  const MatrixXd factor = lin.eliminate->factor();
  rows << factor, factor * solution.linear;
  return rows;
}

}  // namespace unrig
