#include "fit/run_residual.h"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>

#include "core/run_inputs.h"

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::RowVectorXd;
using Eigen::VectorXd;

/// The upper triangular (or trapezoidal) factor of `rows`: the same inner products in no more rows than columns.
MatrixXd compress(MatrixXd rows) {
  const Eigen::HouseholderQR<Eigen::Ref<MatrixXd>> qr(rows);  // in place
  return rows.topRows(std::min(rows.rows(), rows.cols())).triangularView<Eigen::Upper>();
}

}  // namespace

std::vector<MotionBasis::Window> motion_windows(const Run& run) {
  const Channel* alpha = run.find("alpha");
  if (!alpha || run.kind != RunKind::step) return {};
  const double sigma = noise_level(alpha->value);
  std::vector<MotionBasis::Window> windows;
  constexpr Index most_knots = 400;  // a motion that goes on and on gets coarser knots
  for (const Interval& i : moving(alpha->value, sigma)) {
    // The load goes with the second derivative: it starts before the angle visibly does, and the drive rings after it has arrived.
    const Index before = std::max<Index>(8, i.length() / 2), after = std::max<Index>(60, 2 * i.length());
    const Index last_knot = run.samples() - 5;
    MotionBasis::Window window{{std::max<Index>(0, i.first - before), std::min(last_knot, i.last + after)}, 1};
    if (!windows.empty() && window.knots.first <= windows.back().knots.last + 4)
      window.knots.first = windows.back().knots.first, windows.pop_back();
    windows.push_back(window);
  }
  Index total = 0;
  for (const auto& w : windows) total += w.knots.length();
  for (auto& w : windows) w.stride = 1 + total / (most_knots + 1);
  return windows;
}

/// The model at one theta: its exact step, what the inputs alone do, and where the unknown motion takes the states.
struct RunResidual::Linearised {
  LinearSystem system;
  ExactStep step;
  Response known;          // response to the measured inputs, empty without
  MatrixXd spline;         // states after a unit spline, n x samples
  MatrixXd spline_summed;  // and their running sum: states after splines at every sample
  std::vector<MatrixXd> free;  // rows of the free response per channel, for the longest segment at rest
};

RunResidual::RunResidual(const AeroelasticModel& model, const Run& run, std::vector<MotionBasis::Window> motion, RunOptions options)
    : model_(&model),
      run_(&run),
      conditions_(conditions_of(run)),
      channels_(model.output_channels(run)),
      motion_(run.samples(), run.dt, motion) {
  conditions_.prescribed_pitch = motion_.unknowns() > 0;
  const Index n = run.samples();
  last_sample_ = n;
  const std::vector<Interval> active = motion_.active();
  if (options.horizon > 0) last_sample_ = std::min(n, (active.empty() ? 0 : active.front().first) + options.horizon);

  VectorXd use = VectorXd::Ones(n);
  if (const Channel* weight = run.find("weight")) use = weight->value.unaryExpr([](double w) { return std::isfinite(w) ? std::sqrt(w) : 0.0; });
  use.tail(n - last_sample_).setZero();

  measured_.resize(n, static_cast<Index>(channels_.size()));
  weight_.resizeLike(measured_);
  for (std::size_t c = 0; c < channels_.size(); ++c) {
    const VectorXd& value = run.channel(channels_[c]).value;
    sigma_.push_back(noise_level(value));
    for (Index k = 0; k < n; ++k) {
      const bool there = std::isfinite(value[k]);
      measured_(k, static_cast<Index>(c)) = there ? value[k] : 0;
      weight_(k, static_cast<Index>(c)) = there ? use[k] / sigma_[c] : 0;
    }
  }
  if (conditions_.prescribed_pitch) {
    const VectorXd& value = run.channel("alpha").value;
    angle_sigma_ = noise_level(value);
    const std::vector<bool> spike = isolated_spikes(value, angle_sigma_, active);
    angle_ = value;
    angle_weight_ = use / angle_sigma_;
    for (Index k = 0; k < n; ++k) {
      if (std::isfinite(value[k]) && !spike[static_cast<std::size_t>(k)]) continue;
      spikes_ += std::isfinite(value[k]) ? 1 : 0;
      angle_[k] = 0;
      angle_weight_[k] = 0;
    }
  }
  inputs_ = run_inputs(run, conditions_);

  Index at = 0;
  for (const Interval& i : active) {
    if (i.first > at) segments_.push_back({{at, i.first}, false});
    segments_.push_back({i, true});
    at = i.last;
  }
  if (at < n) segments_.push_back({{at, n}, false});

  // A step starts in the steady state of its first angle; everything else starts anyhow.
  const LinearSystem system = model.system(conditions_, model.start_values(), channels_);
  free_states_ = run.kind == RunKind::step ? 0 : system.free_states();
  first_state_ = motion_.unknowns();
  first_offset_ = first_state_ + free_states_;
  unknowns_ = first_offset_ + static_cast<Index>(channels_.size());
  if (conditions_.prescribed_pitch) angle_offset_ = unknowns_++;
  prepare_angle_rows();
}

Index RunResidual::observations() const {
  return (weight_.array() > 0).count() + (angle_weight_.size() > 0 ? (angle_weight_.array() > 0).count() : 0);
}

Index RunResidual::degrees_of_freedom() const { return observations() - unknowns_; }

RunResidual::Linearised RunResidual::linearise(const VectorXd& theta, Partials partials) const {
  Linearised lin;
  lin.system = model_->system(conditions_, theta, channels_);
  for (DualMatrix* m : {&lin.system.A, &lin.system.B, &lin.system.C, &lin.system.D})
    for (Index j = 0; j < m->parameters(); ++j) {
      const bool wanted = differentiated_.empty() || std::find(differentiated_.begin(), differentiated_.end(), j) != differentiated_.end();
      if (partials == Partials::none || !wanted) m->partial[static_cast<std::size_t>(j)].resize(0, 0);
    }
  lin.step = exact_step(lin.system, run_->dt);
  if (inputs_.cols() > 0)
    lin.known = drive(lin.system, lin.step, DualMatrix(MatrixXd::Zero(lin.system.states(), 1)), run_->samples(), {}, inputs_, partials);
  if (motion_.unknowns() > 0) {
    Index reach = 0;
    for (const Segment& s : segments_)
      if (s.moving) reach = std::max(reach, s.samples.last - segments_.front().samples.first);
    lin.spline = spline_states(lin.step, reach + 1 - motion_.columns().front().first + 4);
    lin.spline_summed = lin.spline;
    for (Index k = 1; k < lin.spline.cols(); ++k) lin.spline_summed.col(k) += lin.spline_summed.col(k - 1);
  }
  Index longest = 0;
  for (const Segment& s : segments_)
    if (!s.moving) longest = std::max(longest, std::min(s.samples.last, last_sample_) - s.samples.first);
  lin.free = free_response_rows(lin.system, lin.step, longest);
  return lin;
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
MatrixXd RunResidual::motion_state_columns(const MatrixXd& states, const MatrixXd& summed, Index sample) const {
  MatrixXd columns = MatrixXd::Zero(states.rows(), motion_.unknowns());
  for (Index j = 0; j < motion_.unknowns(); ++j) {
    const MotionBasis::Column& column = motion_.columns()[static_cast<std::size_t>(j)];
    for (Index i = 0; i < column.value.size(); ++i) {
      const Index since = sample - column.first - i;
      if (since <= 0) break;
      columns.col(j) += column.value[i] * states.col(since);
    }
    const Index since_tail = sample - column.first - column.value.size();
    if (column.tail != 0 && since_tail > 0) columns.col(j) += column.tail * summed.col(since_tail);
  }
  return columns;
}

/// d state / d c at the first sample of a segment.
MatrixXd RunResidual::segment_start(const Linearised& lin, const Interval& samples) const {
  MatrixXd start = MatrixXd::Zero(lin.system.states(), unknowns_);
  if (motion_.unknowns() > 0) start.leftCols(motion_.unknowns()) = motion_state_columns(lin.spline, lin.spline_summed, samples.first);
  if (free_states_ > 0 && samples.first == 0) start.block(0, first_state_, free_states_, free_states_).setIdentity();
  return start;
}

/// Rows [c | angle] of the angle channel. Where the angle is constant all rows are alike and are one row with their common weight, besides a
/// row for their scatter.
void RunResidual::prepare_angle_rows() {
  angle_rows_.clear();
  if (motion_prior_.rows() > 0) angle_rows_.push_back(motion_prior_);
  if (angle_offset_ < 0) return;
  for (const Segment& segment : segments_) {
    const Interval& s = segment.samples;
    const auto w = angle_weight_.segment(s.first, s.length());
    const auto y = angle_.segment(s.first, s.length());
    if (segment.moving) {
      MatrixXd rows = MatrixXd::Zero(s.length(), unknowns_ + 1);
      rows.leftCols(motion_.unknowns()) = w.asDiagonal() * motion_.angle_columns(s);
      rows.col(angle_offset_) = w;
      rows.col(unknowns_) = w.cwiseProduct(y);
      angle_rows_.push_back(std::move(rows));
      continue;
    }
    const double total = w.squaredNorm();
    if (total == 0) continue;
    const double mean = w.cwiseAbs2().dot(y) / total, root = std::sqrt(total);
    MatrixXd rows = MatrixXd::Zero(2, unknowns_ + 1);
    rows.row(0).head(motion_.unknowns()) = root * motion_.angle_columns({s.first, s.first + 1});
    rows(0, angle_offset_) = root;
    rows(0, unknowns_) = root * mean;
    rows(1, unknowns_) = std::sqrt((w.array() * (y.array() - mean)).square().sum());
    angle_rows_.push_back(std::move(rows));
  }
}

/// All rows [c | y] at this theta, compressed.
MatrixXd RunResidual::solve_rows(const Linearised& lin) const {
  const Index states = lin.system.states(), channel_count = measured_.cols();
  std::vector<MatrixXd> blocks;
  for (const Segment& segment : segments_) {
    const Interval s{segment.samples.first, std::min(segment.samples.last, last_sample_)};
    if (s.length() <= 0) break;
    const Index length = s.length();

    if (segment.moving) {
      for (Index c = 0; c < channel_count; ++c) {
        MatrixXd m = MatrixXd::Zero(length, unknowns_ + 1);
        m.leftCols(motion_.unknowns()) = motion_output_columns(lin, c, s);
        m.col(first_offset_ + c).setOnes();
        m.col(unknowns_) = measured_.col(c).segment(s.first, length);
        if (lin.known.output.size() > 0) m.col(unknowns_) -= lin.known.output.col(c).segment(s.first, length);
        blocks.push_back(weight_.col(c).segment(s.first, length).asDiagonal() * m);
      }
      continue;
    }
    const std::vector<MatrixXd>& free = lin.free;
    const MatrixXd start = segment_start(lin, s);
    for (Index c = 0; c < channel_count; ++c) {
      MatrixXd m(length, states + 2);
      m.leftCols(states) = free[static_cast<std::size_t>(c)].topRows(length);
      m.col(states).setOnes();
      m.col(states + 1) = measured_.col(c).segment(s.first, length);
      if (lin.known.output.size() > 0) m.col(states + 1) -= lin.known.output.col(c).segment(s.first, length);
      m = compress(weight_.col(c).segment(s.first, length).asDiagonal() * m);
      MatrixXd rows = MatrixXd::Zero(m.rows(), unknowns_ + 1);
      rows.leftCols(unknowns_).noalias() = m.leftCols(states) * start;
      rows.col(first_offset_ + c) += m.col(states);
      rows.col(unknowns_) = m.col(states + 1);
      blocks.push_back(std::move(rows));
    }
  }
  blocks.insert(blocks.end(), angle_rows_.begin(), angle_rows_.end());

  Index total = 0;
  for (const MatrixXd& block : blocks) total += block.rows();
  MatrixXd stack(total, unknowns_ + 1);
  Index row = 0;
  for (const MatrixXd& block : blocks) {
    stack.middleRows(row, block.rows()) = block;
    row += block.rows();
  }
  return stack;
}

RunResidual::Sensitivity RunResidual::sensitivity(const VectorXd& theta) const {
  const Linearised lin = linearise(theta, Partials::all);
  const Evaluation e = evaluate(theta, Partials::all);
  const auto parameters = static_cast<Index>(model_->parameters().size());
  const Index channel_count = measured_.cols(), n = run_->samples();
  Sensitivity result;
  result.channels.assign(static_cast<std::size_t>(channel_count), {VectorXd::Zero(n), MatrixXd::Zero(n, parameters)});
  DualMatrix state(MatrixXd::Zero(lin.system.states(), 1), parameters);
  state.value.col(0).head(free_states_) = e.linear.segment(first_state_, free_states_);
  VectorXd jerk;
  if (motion_.unknowns() > 0) jerk = motion_of(motion_.coefficients(e.linear.head(motion_.unknowns())), run_->dt).jerk;
  for (const Segment& segment : segments_) {
    const Interval s{segment.samples.first, std::min(segment.samples.last, last_sample_)};
    if (s.length() <= 0) break;
    const Response response = segment.moving ? drive(lin.system, lin.step, state, s.length(), jerk.segment(s.first, s.length()), {}, Partials::all)
                                             : coast(lin.system, lin.step, state, s.length(), Partials::all);
    state = response.end;
    const MatrixXd follow = segment.moving ? MatrixXd() : MatrixXd(segment_start(lin, s) * e.linear_slope);  // state moves with c, c with theta
    for (Index c = 0; c < channel_count; ++c) {
      auto& channel = result.channels[static_cast<std::size_t>(c)];
      MatrixXd slope = segment.moving ? MatrixXd(motion_output_columns(lin, c, s) * e.linear_slope.topRows(motion_.unknowns()))
                                      : MatrixXd(lin.free[static_cast<std::size_t>(c)].topRows(s.length()) * follow);
      slope.rowwise() += e.linear_slope.row(first_offset_ + c);
      VectorXd predicted = response.output.col(c).array() + e.linear[first_offset_ + c];
      for (Index j = 0; j < parameters; ++j) {
        const auto index = static_cast<std::size_t>(j);
        if (index < response.partial.size() && response.partial[index].size() > 0) slope.col(j) += response.partial[index].col(c);
        if (index < lin.known.partial.size() && lin.known.partial[index].size() > 0) slope.col(j) += lin.known.partial[index].col(c).segment(s.first, s.length());
      }
      if (lin.known.output.size() > 0) predicted += lin.known.output.col(c).segment(s.first, s.length());
      const auto w = weight_.col(c).segment(s.first, s.length());
      channel.residual.segment(s.first, s.length()) = w.cwiseProduct(measured_.col(c).segment(s.first, s.length()) - predicted);
      channel.slope.middleRows(s.first, s.length()) = w.asDiagonal() * slope;
    }
  }
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
  return compress(free.solve_rows(free.linearise(theta, Partials::none)));
}

void RunResidual::set_motion_prior(const MatrixXd& rows) {
  motion_prior_ = MatrixXd::Zero(rows.rows(), unknowns_ + 1);
  if (rows.rows() > 0) motion_prior_.leftCols(unknowns_) = rows;
  prepare_angle_rows();
}

namespace {

/// Least squares over the leading columns; columns that the rows do not determine get the solution of least norm.
VectorXd least_squares(const MatrixXd& rows) {
  const Index n = rows.cols() - 1;
  const VectorXd scale = rows.leftCols(n).colwise().norm().cwiseMax(1e-300).transpose();
  const MatrixXd scaled = rows.leftCols(n) * scale.cwiseInverse().asDiagonal();
  const Eigen::HouseholderQR<MatrixXd> qr(scaled);
  const VectorXd diagonal = qr.matrixQR().diagonal().cwiseAbs();
  constexpr double rank_tolerance = 1e-11;
  VectorXd c;
  if (rows.rows() >= n && diagonal.minCoeff() > rank_tolerance) {
    c = qr.solve(rows.col(n));
  } else {
    Eigen::CompleteOrthogonalDecomposition<MatrixXd> cod;
    cod.setThreshold(rank_tolerance);
    cod.compute(scaled);
    c = cod.solve(rows.col(n));
  }
  return c.cwiseQuotient(scale);
}

}  // namespace

RunResidual::Evaluation RunResidual::evaluate(const VectorXd& theta, Partials partials) const {
  const Linearised lin = linearise(theta, partials);
  const MatrixXd rows = solve_rows(lin);
  Evaluation result;
  result.linear = least_squares(rows);
  const VectorXd residual = rows.col(unknowns_) - rows.leftCols(unknowns_) * result.linear;
  result.chi2 = residual.squaredNorm();
  const auto parameters = static_cast<Index>(model_->parameters().size());
  result.residual = VectorXd::Zero(parameters + 1);
  if (partials == Partials::none) {
    result.residual[parameters] = std::sqrt(result.chi2);
    return result;
  }

  // d y / d theta at fixed c, weighted, segment by segment; then project out what c can follow.
  DualMatrix state(MatrixXd::Zero(lin.system.states(), 1), parameters);
  state.value.col(0).head(free_states_) = result.linear.segment(first_state_, free_states_);
  VectorXd jerk;
  if (motion_.unknowns() > 0) jerk = motion_of(motion_.coefficients(result.linear.head(motion_.unknowns())), run_->dt).jerk;
  std::vector<MatrixXd> blocks;
  for (const Segment& segment : segments_) {
    const Interval s{segment.samples.first, std::min(segment.samples.last, last_sample_)};
    if (s.length() <= 0) break;
    const Response response = segment.moving
                                  ? drive(lin.system, lin.step, state, s.length(), jerk.segment(s.first, s.length()), {}, Partials::all)
                                  : coast(lin.system, lin.step, state, s.length(), Partials::all);
    state = response.end;
    for (Index c = 0; c < measured_.cols(); ++c) {
      const auto w = weight_.col(c).segment(s.first, s.length());
      MatrixXd slopes = MatrixXd::Zero(s.length(), parameters + 1);  // last column: the residual itself
      for (Index j = 0; j < parameters; ++j) {
        const auto index = static_cast<std::size_t>(j);
        if (index < response.partial.size() && response.partial[index].size() > 0) slopes.col(j) -= response.partial[index].col(c);
        if (index < lin.known.partial.size() && lin.known.partial[index].size() > 0) slopes.col(j) -= lin.known.partial[index].col(c).segment(s.first, s.length());
      }
      VectorXd predicted = response.output.col(c).array() + result.linear[first_offset_ + c];
      if (lin.known.output.size() > 0) predicted += lin.known.output.col(c).segment(s.first, s.length());
      slopes.col(parameters) = measured_.col(c).segment(s.first, s.length()) - predicted;
      const MatrixXd weighted = w.asDiagonal() * slopes;

      // The same rows again, now with what c does beside what theta does.
      MatrixXd stacked;
      if (segment.moving) {
        MatrixXd columns = MatrixXd::Zero(s.length(), unknowns_);
        columns.leftCols(motion_.unknowns()) = motion_output_columns(lin, c, s);
        columns.col(first_offset_ + c).setOnes();
        stacked.resize(s.length(), unknowns_ + parameters + 1);
        stacked << w.asDiagonal() * columns, weighted;
      } else {
        const Index states = lin.system.states();
        const MatrixXd start = segment_start(lin, s);
        MatrixXd m(s.length(), states + 1 + parameters + 1);
        m.leftCols(states) = w.asDiagonal() * lin.free[static_cast<std::size_t>(c)].topRows(s.length());
        m.col(states) = w;
        m.rightCols(parameters + 1) = weighted;
        m = compress(std::move(m));
        stacked = MatrixXd::Zero(m.rows(), unknowns_ + parameters + 1);
        stacked.leftCols(unknowns_).noalias() = m.leftCols(states) * start;
        stacked.col(first_offset_ + c) += m.col(states);
        stacked.rightCols(parameters + 1) = m.rightCols(parameters + 1);
      }
      blocks.push_back(std::move(stacked));
    }
  }
  for (const MatrixXd& block : angle_rows_) {
    MatrixXd stacked = MatrixXd::Zero(block.rows(), unknowns_ + parameters + 1);
    stacked.leftCols(unknowns_) = block.leftCols(unknowns_);
    stacked.col(unknowns_ + parameters) = block.col(unknowns_) - block.leftCols(unknowns_) * result.linear;
    blocks.push_back(std::move(stacked));
  }
  Index total = 0;
  for (const MatrixXd& block : blocks) total += block.rows();
  MatrixXd stack(total, unknowns_ + parameters + 1);
  Index row = 0;
  for (const MatrixXd& block : blocks) {
    stack.middleRows(row, block.rows()) = block;
    row += block.rows();
  }
  const MatrixXd triangle = compress(std::move(stack));
  const Index left = std::min(triangle.rows() - unknowns_, parameters + 1);
  result.jacobian = MatrixXd::Zero(parameters + 1, parameters);
  if (left >= 0) {
    const auto factor = triangle.topLeftCorner(unknowns_, unknowns_).triangularView<Eigen::Upper>();
    result.linear_factor = factor;
    result.linear_slope = factor.solve(triangle.block(0, unknowns_, unknowns_, parameters));
  }
  if (left > 0) {
    result.jacobian.topRows(left) = triangle.block(unknowns_, unknowns_, left, parameters);
    result.residual.head(left) = triangle.block(unknowns_, unknowns_ + parameters, left, 1);
  }
  return result;
}

RunResidual::Prediction RunResidual::predict(const VectorXd& theta) const {
  const Linearised lin = linearise(theta, Partials::none);
  const MatrixXd rows = solve_rows(lin);
  Prediction p;
  p.channels = channels_;
  p.linear = least_squares(rows);
  p.linear_factor = compress(rows).topLeftCorner(std::min(rows.rows(), unknowns_), unknowns_);
  p.offset = p.linear.segment(first_offset_, measured_.cols());
  p.initial_state = p.linear.segment(first_state_, free_states_);
  if (angle_offset_ >= 0) p.angle_offset = p.linear.segment(angle_offset_, 1);
  if (motion_.unknowns() > 0) p.motion = motion_of(motion_.coefficients(p.linear.head(motion_.unknowns())), run_->dt);
  p.output.resize(run_->samples(), measured_.cols());
  DualMatrix state(MatrixXd::Zero(lin.system.states(), 1));
  state.value.col(0).head(free_states_) = p.initial_state;
  for (const Segment& segment : segments_) {
    const Interval& s = segment.samples;
    const Response response = segment.moving ? drive(lin.system, lin.step, state, s.length(), p.motion.jerk.segment(s.first, s.length()), {}, Partials::none)
                                             : coast(lin.system, lin.step, state, s.length(), Partials::none);
    state = response.end;
    p.output.middleRows(s.first, s.length()) = response.output;
  }
  if (lin.known.output.size() > 0) p.output += lin.known.output;
  p.output.rowwise() += p.offset.transpose();
  return p;
}

RunResidual RunResidual::with_motion(std::vector<MotionBasis::Window> windows) const {
  RunResidual other(*model_, *run_, std::move(windows));
  other.sigma_ = sigma_;
  other.weight_ = weight_;
  other.angle_sigma_ = angle_sigma_;
  other.angle_ = angle_;
  other.angle_weight_ = angle_weight_;
  other.spikes_ = spikes_;
  other.prepare_angle_rows();
  return other;
}

void RunResidual::settle_noise(const VectorXd& theta) {
  const Prediction p = predict(theta);
  const auto settle = [&](VectorXd residual, Eigen::Ref<VectorXd> weight, double& sigma) {
    for (Index k = 0; k < residual.size(); ++k)
      if (weight[k] == 0) residual[k] = std::nan("");
    constexpr double chance = 0.06;  // two standard deviations between the two estimates for some thousand samples
    const double third = noise_level(residual, 3), first = noise_level(residual, 1);
    const double level = first < (1 + chance) * third ? first : third;
    if (!(level > 0) || level >= sigma) return;
    weight *= sigma / level;
    sigma = level;
  };
  for (std::size_t c = 0; c < channels_.size(); ++c) {
    const auto column = static_cast<Index>(c);
    settle(measured_.col(column) - p.output.col(column), weight_.col(column), sigma_[c]);
  }
  if (angle_offset_ >= 0) settle(angle_ - p.motion.angle - VectorXd::Constant(angle_.size(), p.angle_offset[0]), angle_weight_, angle_sigma_);
  prepare_angle_rows();
}

Index RunResidual::reject_spikes(const VectorXd& theta, double limit) {
  if (angle_offset_ < 0) return 0;
  const Prediction p = predict(theta);
  const auto off = [&](Index k) {
    return k >= 0 && k < last_sample_ && angle_weight_[k] > 0 && std::abs(angle_[k] - p.angle_offset[0] - p.motion.angle[k]) > limit * angle_sigma_;
  };
  std::vector<Index> spikes;
  for (Index k = 0; k < last_sample_; ++k)
    if (off(k) && !(off(k - 1) && off(k + 1)) && !(off(k - 2) && off(k - 1)) && !(off(k + 1) && off(k + 2))) spikes.push_back(k);
  for (Index k : spikes) angle_weight_[k] = 0;
  const auto rejected = static_cast<Index>(spikes.size());
  spikes_ += rejected;
  prepare_angle_rows();
  return rejected;
}

}  // namespace unrig
