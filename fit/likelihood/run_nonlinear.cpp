#include <algorithm>
#include <cmath>
#include <utility>

#include "core/numerics/product.h"
#include "core/propagate/nonlinear_response.h"
#include "core/propagate/static_state.h"
#include "fit/likelihood/run_linearised.h"

// RunResidual with nonlinear effects at work: the linear unknowns c by Gauss-Newton steps.

namespace unrig {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

/// Jerk and inputs of one phase.
void drive_over(const Interval& s, bool moving, const VectorXd& jerk, const MatrixXd& inputs, NonlinearDrive& drive) {
  drive.jerk = moving ? VectorXd(jerk.segment(s.first, s.length())) : VectorXd();
  drive.input = inputs.cols() > 0 ? MatrixXd(inputs.middleRows(s.first, s.length() + 1)) : MatrixXd(s.length() + 1, 0);
}

}  // namespace

VectorXd RunResidual::whole_jerk(const VectorXd& linear) const {
  return motion_.unknowns() > 0 ? motion_of(motion_.coefficients(linear.head(motion_.unknowns())), run_->dt).jerk : VectorXd();
}

/// d jerk / d c over these samples, of the splines that act in them: every spline's third difference.
MatrixXd RunResidual::jerk_slope(const Interval& samples) const {
  constexpr double third_difference[] = {1, -3, 3, -1};
  const double cube = run_->dt * run_->dt * run_->dt;
  const Splines splines = splines_in(samples);
  MatrixXd slope = MatrixXd::Zero(samples.length(), splines.all());
  for (Index j = 0; j < slope.cols(); ++j) {
    const MotionBasis::Column& column = motion_.columns()[static_cast<std::size_t>(splines.still + j)];
    const Index length = column.value.size();
    for (Index i = 0; i < length + 3; ++i) {  // from there on the splines of the tail cancel
      const double amount = (i < length ? column.value[i] : column.tail) / cube;
      for (Index d = 0; d < 4; ++d) {
        if (i >= length && i + d >= length + 3) break;
        const Index k = column.first + i + d - samples.first;
        if (k >= 0 && k < samples.length()) slope(k, j) += amount * third_difference[d];
      }
    }
  }
  return slope;
}

/// The model at one c, without tangents.
struct RunResidual::NonlinearPoint {
  VectorXd linear;
  MatrixXd left;  // measured - predicted, samples x channels
  double chi2 = INFINITY;
};

RunResidual::NonlinearPoint RunResidual::nonlinear_point(const Linearised& lin, const VectorXd& theta, const VectorXd& linear) const {
  NonlinearDrive from{initial_state(linear, lin.system.states()), whole_jerk(linear), inputs_, MatrixXd(lin.system.states(), 0), {}};
  NonlinearResponse response = follow(lin.system, lin.step, theta, from, last_sample_, Partials::none);
  NonlinearPoint point{linear, {}};
  if (!response.finite) return point;
  FilterStates filters = filters_at(initial_state(linear, lin.system.states() + filter_states()));
  for (Index c = 0; c < measured_.cols(); ++c) filter_outputs(static_cast<std::size_t>(c), response.output.col(c), filters);
  point.left = readings().topRows(last_sample_) - response.output;
  point.left.rowwise() -= linear.segment(first_offset_, measured_.cols()).transpose();
  point.chi2 = lin.noise ? lin.white(*this, point.left.reshaped()).squaredNorm() : weight_.topRows(last_sample_).cwiseProduct(point.left).squaredNorm();
  point.chi2 += held_residual(linear).squaredNorm();
  for (std::size_t p = 0; p < angle_rows_.size(); ++p) point.chi2 += angle_residual(p, linear).squaredNorm();
  return point;
}

VectorXd RunResidual::largest_arguments(const VectorXd& theta) const {
  const Solution solution = solve(theta);
  const Linearised& lin = *solution.model;
  if (lin.system.feedback.empty()) return {};
  if (!std::isfinite(lin.chi2)) return VectorXd::Zero(static_cast<Index>(lin.system.feedback.size()));
  const NonlinearDrive from{initial_state(lin.linear, lin.system.states()), whole_jerk(lin.linear), inputs_, MatrixXd(lin.system.states(), 0), {}};
  return follow(lin.system, lin.step, theta, from, last_sample_, Partials::none).largest_argument;
}

/// The rows of the model linearised about `linear`, piece by piece; solves them for the next c. False where the model diverges. The state of a link is that of the model, of the filters of the
/// noise behind it, with what the splines that act still have done so far.
bool RunResidual::stack_nonlinear_rows(Linearised& lin, const VectorXd& theta, const VectorXd& linear) const {
  const Index n = lin.system.states(), with_filters = n + filter_states();
  const VectorXd jerk = whole_jerk(linear);
  NonlinearDrive from{initial_state(linear, n), {}, {}, {}, {}};
  FilterStates filters = filters_at(initial_state(linear, with_filters));
  MatrixXd start = MatrixXd::Zero(with_filters, unknowns_);  // d state / d c, those of the filters behind the model's
  for (std::size_t i = 0; i < free_.size(); ++i) start(free_[i], first_state_ + static_cast<Index>(i)) = 1;
  lin.blocks.clear();
  lin.linked = false;
  Linearised::Rows rows(*this, is_linked());
  bool moved = has_state(pieces_.front(), start);
  if (moved) rows.begin(start);
  double unreachable = 0;
  const std::size_t count = counted_pieces();
  for (std::size_t p = 0; p < count; ++p) {
    const Piece& piece = pieces_[p];
    const Splines& splines = piece.splines;
    const Interval s = counted(piece.samples);
    moved = moved || piece.splines.begin > 0;
    const Index states = moved || !piece.moving ? with_filters : 0, acting = piece.moving && s.length() > 0 ? splines_in(s).all() : 0;
    VectorXd at(states + acting);  // what tangents are taken in, as `linear` has it
    at << (start * linear).head(states), linear.segment(splines.still, acting);
    MatrixXd end = MatrixXd::Zero(with_filters, at.size());  // d state / d that, behind the piece
    if (s.length() > 0) {
      drive_over(s, piece.moving, jerk, inputs_, from);
      MatrixXd tangents = MatrixXd::Zero(with_filters, at.size());
      tangents.leftCols(states).setIdentity();
      from.start_tangent = tangents.topRows(n);
      from.jerk_tangent = MatrixXd();
      if (piece.moving) {
        from.jerk_tangent = MatrixXd::Zero(s.length(), at.size());
        from.jerk_tangent.rightCols(acting) = jerk_slope(s);
      }
      FilterStates filter_tangents = filters_at(tangents);
      NonlinearResponse response = follow(lin.system, lin.step, theta, from, s.length(), Partials::none);
      if (!response.finite) return false;
      if (lin.noise) {  // there is one piece
        MatrixXd left = measured_.topRows(last_sample_) - response.output;
        for (Index c = 0; c < measured_.cols(); ++c) left.col(c) += response.tangent[static_cast<std::size_t>(c)] * at;
        lin.settle_white(*this, start, std::move(response.tangent), left);
        return true;
      }
      for (Index c = 0; c < measured_.cols(); ++c) {
        const auto channel = static_cast<std::size_t>(c);
        const auto w = weight_.col(c).segment(s.first, s.length());
        MatrixXd& tangent = response.tangent[channel];
        filter_outputs(channel, tangent, filter_tangents);
        filter_outputs(channel, response.output.col(c), filters);
        const VectorXd y = readings().col(c).segment(s.first, s.length()) - response.output.col(c) + tangent * at;  // beside the offset, which stays linear
        run_rows::Block block{s, piece.moving, c, start, std::move(tangent), s.last};
        MatrixXd of_splines = MatrixXd::Zero(piece.moving ? s.length() : 0, splines.all()), of_states, offset = w;
        if (piece.moving) {
          of_states = w.asDiagonal() * block.rows.leftCols(states);
          of_splines.leftCols(acting) = w.asDiagonal() * block.rows.rightCols(acting);
        } else {
          const MatrixXd span = block.rotate_rows(w);
          of_states = span.leftCols(states);
          offset = span.rightCols(1);
        }
        if (!moved) of_states.resize(0, 0);
        run_rows::Rotated rotated;
        block.rotate(s, w.cwiseProduct(y), rotated);
        const MatrixXd right = block.reached(rotated);
        for (const MatrixXd& others : rotated.others) unreachable += others.squaredNorm();
        rows.add(moved, link_rows(piece, moved, of_splines, of_states, offset, first_offset_ + c), right, start);
        lin.blocks.push_back(std::move(block));
      }
      end.topRows(n) = response.end_tangent;
      Index row = n;
      for (const MatrixXd& of_filter : filter_tangents) end.middleRows(row, of_filter.rows()) = of_filter, row += of_filter.rows();
      from.start = response.end;
    }
    MatrixXd moves;
    if (!rows.is_last() && (moved || splines.end > 0)) moves = transition(piece, moved, pieces_[p + 1].splines, end.leftCols(states), end.rightCols(acting));
    rows.end_piece(moved, std::move(moves));
    start = states > 0 ? product(end.leftCols(states), start) : MatrixXd(MatrixXd::Zero(with_filters, unknowns_));
    start.middleCols(splines.still, acting) += end.rightCols(acting);
  }
  rows.settle(lin, unreachable);
  return true;
}

/// c of the linear part alone.
VectorXd RunResidual::without_laws(const Linearised& lin) const {
  Linearised plain;
  plain.system = linear_part(lin.system);
  plain.step = exact_step(plain.system, run_->dt);
  filter_output(plain.system, plain.step);
  prepare_linear(plain);
  stack_rows(plain);
  return plain.linear;
}

/// c of a pluck that is let go at its first reading, from the deflection under a load that this reading tells, and comes to rest; empty of other runs. Where a law is strong, a search from elsewhere loses its way.
VectorXd RunResidual::Linearised::released(const RunResidual& run, const VectorXd& theta) const {
  if (run.run_->kind != RunKind::pluck || !run.model_->rig().takes_force() || run.conditions_.force || run.arrival_.rows() > 0) return {};
  Conditions held = run.conditions_;
  held.force = true;
  const LinearSystem loaded = run.model_->system(held, theta, run.channels_);
  const VectorXd deflected = static_state(loaded, loaded.B.value.col(0));
  VectorXd c = VectorXd::Zero(run.unknowns_);
  double told = 0, weight = 0;
  for (Index k = 0; k < run.weight_.cols(); ++k) {
    const VectorXd last = run.weight_.col(k).tail(run.weight_.rows() / 2).cwiseAbs2();
    const double offset = last.sum() > 0 ? last.dot(run.measured_.col(k).tail(last.size())) / last.sum() : 0, reads = run.weight_(0, k) * loaded.C.value.row(k).dot(deflected);
    told += reads * run.weight_(0, k) * (run.measured_(0, k) - offset);
    weight += reads * reads;
    c[run.first_offset_ + k] = offset;
  }
  if (!(weight > 0)) return {};
  for (std::size_t i = 0; i < run.free_.size(); ++i)
    if (run.free_[i] < deflected.size()) c[run.first_state_ + static_cast<Index>(i)] = told / weight * deflected[run.free_[i]];
  return c;
}

/// Standard errors widen with what is left.
bool RunResidual::worth_going_on(double promised, double chi2) const {
  constexpr double rounding = 1e-9;
  const double left = std::max(1.0, chi2 / static_cast<double>(std::max<Index>(1, degrees_of_freedom())));
  return promised > linear_precision_ * linear_precision_ * left + rounding * chi2;
}

/// c that the last slopes lead to from where they were taken, else that of the last solution or, where there is none, of the linear part alone. Where these do not follow a decay, what a
/// record that grows leads to from the best of them and, of a pluck, its release.
RunResidual::NonlinearPoint RunResidual::first_nonlinear_point(const Linearised& lin, const VectorXd& theta) const {
  NonlinearPoint best;
  const auto consider = [&](const VectorXd& linear) {
    if (NonlinearPoint point = nonlinear_point(lin, theta, linear); point.chi2 < best.chi2 || !std::isfinite(best.chi2)) best = std::move(point);
  };
  if (guide_.theta.size() == theta.size() && !from_afar_) {
    const VectorXd predicted = guide_.linear + guide_.slope * (theta - guide_.theta);
    if (predicted.allFinite()) consider(predicted);
    if (std::isfinite(best.chi2) && best.chi2 < 2 * guide_.chi2) return best;
  }
  if (last_linear_.size() > 0) consider(last_linear_);
  if (!std::isfinite(best.chi2)) consider(without_laws(lin));
  if (glance_) return best;
  constexpr double followed = 2;
  const bool lost = motion_.unknowns() == 0 && best.chi2 * tempered_ * tempered_ > followed * static_cast<double>(degrees_of_freedom());
  if (!lost && !from_afar_) return best;
  if (const VectorXd c = lin.released(*this, theta); c.size() > 0) consider(c);
  if (NonlinearPoint grown = along_growing_record(lin, theta, best); grown.chi2 < best.chi2) return grown;
  return best;
}

/// c from the angle channel alone.
VectorXd RunResidual::as_the_angle_says() const {
  const MatrixXd rows = angle_rows();
  const run_rows::Eliminator angle(rows.leftCols(unknowns_));
  return angle.solve(angle.rotated(rows.rightCols(1)));
}

/// c searched along exact tangents over a part of the record that grows from where any start will do: of a motion, from just behind its beginning, where the angle has said nearly
/// all and the law has turned the trajectory once at most. The least chi-squares of a motion are many: smaller strides lead to others.
RunResidual::NonlinearPoint RunResidual::along_growing_record(const Linearised& lin, const VectorXd& theta, NonlinearPoint point) const {
  constexpr double growth = 1.3, small = 1.1, followed = 1.5, lost = 4;
  const bool moves = motion_.unknowns() > 0;  // under a law with corners: elsewhere a motion is led in (fit/search/find_motion.h)
  constexpr Index hardly_moved = 20;
  constexpr int on_the_way = 10;  // steps: each part begins near where the one before it ended
  const Index before = moves ? motion_.active().front().first : 0, first = before + (moves ? hardly_moved : 2 * unknowns_);
  if (moves) point.linear = as_the_angle_says();
  const auto in_strides = [&](double stride) {
    RunResidual part = *this;
    Linearised part_lin;
    part_lin.system = lin.system;
    part_lin.step = lin.step;
    NonlinearPoint at = point;
    for (part.last_sample_ = std::min(last_sample_, first); part.last_sample_ < last_sample_;) {
      part.search_along_tangents(part_lin, theta, part.nonlinear_point(lin, theta, at.linear), moves ? on_the_way : part.most_steps());
      if (!std::isfinite(part_lin.chi2)) return at;
      at.linear = part_lin.linear;
      const double noise = static_cast<double>((measured_.cols() + 1) * part.last_sample_) / (tempered_ * tempered_);
      if (moves && part_lin.chi2 > lost * noise) break;  // nothing further on leads back
      part.last_sample_ = std::min(last_sample_, before + static_cast<Index>(stride * static_cast<double>(part.last_sample_ - before)) + 1);
    }
    return nonlinear_point(lin, theta, at.linear);
  };
  NonlinearPoint found = in_strides(growth);
  if (!moves || !thorough_ || found.chi2 * tempered_ * tempered_ < followed * static_cast<double>(degrees_of_freedom())) return found;
  NonlinearPoint other = in_strides(small);
  return other.chi2 < found.chi2 ? other : found;
}

/// In a search for c.
int RunResidual::most_steps() const {
  constexpr int a_glance = 2, nearby = 15, far_away = 30;  // a motion is searched again at the next theta
  return glance_ ? a_glance : motion_.unknowns() > 0 && !from_afar_ ? nearby : far_away;
}

void RunResidual::solve_nonlinear(Linearised& lin, const VectorXd& theta) const {
  NonlinearPoint point = first_nonlinear_point(lin, theta);
  lin.chi2 = INFINITY;
  if (!std::isfinite(point.chi2)) return;
  const bool arrived = search_along_tangents(lin, theta, std::move(point), most_steps());
  if (!arrived && !glance_ && !from_afar_ && motion_.unknowns() > 0 && takes_small_steps(theta)) search_from_the_beginning(lin, theta);
  if (std::isfinite(lin.chi2)) last_linear_ = lin.linear;
}

/// Between the corners of a law a search for c may come to rest far from any least chi-square. Where theta is wrong there is none: not again after a few times in vain.
void RunResidual::search_from_the_beginning(Linearised& lin, const VectorXd& theta) const {
  constexpr int enough = 3;
  if (in_vain_ >= enough) return;
  NonlinearPoint grown = along_growing_record(lin, theta, {});
  const bool arrived = grown.chi2 < lin.chi2 && search_along_tangents(lin, theta, std::move(grown), most_steps());
  in_vain_ = arrived ? 0 : in_vain_ + 1;
}

/// Levenberg-Marquardt steps in c: a full Gauss-Newton step where chi-square falls by it, else the more damped the longer it does not. False where it comes to rest although the
/// slopes promise more than some per cent of chi-square, after `most` steps at the latest.
bool RunResidual::search_along_tangents(Linearised& lin, const VectorXd& theta, NonlinearPoint point, int most) const {
  constexpr double least_damping = 1e-4, most_damping = 1e4, growth = 10, much = 0.02;
  double damping = 0;
  bool near = false;
  lin.settled = true;
  for (int i = 0; i < most; ++i) {
    if (!stack_nonlinear_rows(lin, theta, point.linear)) {
      lin.chi2 = INFINITY;
      lin.settled = false;
      return false;
    }
    const VectorXd step = lin.linear - point.linear;
    const double promised = point.chi2 - lin.chi2;
    lin.linear = point.linear;
    lin.chi2 = point.chi2;
    near = promised < much * point.chi2;
    if (!worth_going_on(promised, point.chi2)) return true;
    const auto damped = [&] { return damping > 0 ? lin.eliminate->damped_step(step, damping) : step; };
    NonlinearPoint next = nonlinear_point(lin, theta, point.linear + damped());
    while (!(next.chi2 < point.chi2) && damping < most_damping) {
      damping = std::max(least_damping, growth * damping);
      next = nonlinear_point(lin, theta, point.linear + damped());
    }
    if (!(next.chi2 < point.chi2)) return near;
    const double gained = point.chi2 - next.chi2;
    const bool creeps = gained < 0.01 * promised && gained < 1e-3 * point.chi2;
    if (creeps) return near;
    damping = damping > least_damping ? damping / growth : 0;
    point = std::move(next);
  }
  lin.settled = false;
  return near;
}

void RunResidual::follow_nonlinear_partials(const LinearSystem& system, const VectorXd& theta, const VectorXd& linear, const TakeRows& take) const {
  const ExactStep step = step_to_follow(system, run_->dt);
  const auto parameters = static_cast<Index>(model_->parameters().size());
  const VectorXd jerk = whole_jerk(linear);
  NonlinearDrive from{initial_state(linear, system.states()), {}, {}, MatrixXd(system.states(), 0), {}};
  MatrixXd start = MatrixXd::Zero(system.states() + filter_states(), parameters + 1);  // [d / d theta | value]
  start.col(parameters) = initial_state(linear, start.rows());
  FilterStates filters = filters_at(start);
  std::size_t block = 0;
  for (const Piece& piece : pieces_) {
    const Interval s = counted(piece.samples);
    if (s.length() <= 0) break;
    drive_over(s, piece.moving, jerk, inputs_, from);
    const NonlinearResponse response = follow(system, step, theta, from, s.length(), Partials::all);
    for (Index c = 0; c < measured_.cols(); ++c) {
      MatrixXd m(s.length(), parameters + 1);
      m << response.tangent[static_cast<std::size_t>(c)], response.output.col(c);
      filter_outputs(static_cast<std::size_t>(c), m, filters);
      m.col(parameters).array() += linear[first_offset_ + c];
      take(block++, s, std::move(m));
    }
    from.start = response.end;
    from.start_partial = response.end_tangent;
  }
}

bool RunResidual::find_linear(const VectorXd& theta, bool thoroughly) {
  if (model_->system(conditions_, theta, channels_).feedback.empty()) return false;
  forget_solutions();
  from_afar_ = true;
  in_vain_ = 0;
  thorough_ = thoroughly;
  solve(theta);
  from_afar_ = thorough_ = false;
  guide_ = {};
  return true;
}

bool RunResidual::takes_small_steps(const VectorXd& theta) const {
  const LinearSystem system = model_->system(conditions_, theta, channels_);
  return std::any_of(system.feedback.begin(), system.feedback.end(), [](const Feedback& f) { return f.steps_per_sample > 1; });
}

RunResidual::SideBySide RunResidual::side_by_side(const VectorXd& theta, const VectorXd& linear, Index samples, Partials partials) const {
  samples = std::min(samples, last_sample_);
  const bool slopes = partials == Partials::all;
  LinearSystem system = slopes ? differentiable_system(theta, differentiated_) : searched_system(theta);
  if (!slopes)
    for (DualMatrix* m : {&system.A, &system.B, &system.C, &system.D}) m->partial.clear();
  const Index n = system.states(), states = static_cast<Index>(free_.size()), channels = measured_.cols(), parameters = static_cast<Index>(model_->parameters().size());
  NonlinearDrive from{initial_state(linear, n), {}, inputs_, MatrixXd::Zero(n, slopes ? states : 0), {}};
  MatrixXd start = MatrixXd::Zero(n + filter_states(), states + parameters);
  for (Index i = 0; i < states; ++i) start(free_[static_cast<std::size_t>(i)], i) = 1;
  if (slopes) from.start_tangent = start.topLeftCorner(n, states);
  NonlinearResponse response = follow(system, step_to_follow(system, run_->dt), theta, from, samples, partials);
  SideBySide result;
  result.chi2 = INFINITY;
  if (!response.finite) return result;
  FilterStates filters = filters_at(initial_state(linear, start.rows())), filter_tangents = filters_at(start);
  for (Index c = 0; c < channels; ++c) {
    filter_outputs(static_cast<std::size_t>(c), response.output.col(c), filters);
    if (slopes) filter_outputs(static_cast<std::size_t>(c), response.tangent[static_cast<std::size_t>(c)], filter_tangents);
  }
  MatrixXd left = readings().topRows(samples) - response.output;
  left.rowwise() -= linear.segment(first_offset_, channels).transpose();
  left.array() *= weight_.topRows(samples).array();
  const MatrixXd known = angle_rows();  // of the noise's own state
  const VectorXd off = known.col(unknowns_) - known.leftCols(unknowns_) * linear;
  result.chi2 = left.squaredNorm() + off.squaredNorm();
  if (!slopes) return result;
  MatrixXd rows = MatrixXd::Zero(channels * samples + known.rows(), parameters + unknowns_ + 1);
  rows.bottomRows(known.rows()).middleCols(parameters, unknowns_) = -known.leftCols(unknowns_);
  rows.bottomRows(known.rows()).rightCols(1) = off;
  for (Index c = 0; c < channels; ++c) {
    auto of_channel = rows.middleRows(c * samples, samples);
    const auto w = weight_.col(c).head(samples);
    const MatrixXd& tangent = response.tangent[static_cast<std::size_t>(c)];
    of_channel.leftCols(parameters) = -(w.asDiagonal() * tangent.rightCols(parameters));
    of_channel.middleCols(parameters + first_state_, states) = -(w.asDiagonal() * tangent.leftCols(states));
    of_channel.col(parameters + first_offset_ + c) = -w;
    of_channel.col(parameters + unknowns_) = left.col(c);
  }
  rows = run_rows::compress(std::move(rows));
  result.in_theta = rows.leftCols(parameters);
  result.in_c = rows.middleCols(parameters, unknowns_);
  result.residual = rows.col(parameters + unknowns_);
  return result;
}

}  // namespace unrig
