#include <algorithm>
#include <cmath>
#include <optional>

#include "core/numerics/product.h"
#include "core/propagate/nonlinear_response.h"
#include "fit/likelihood/run_linearised.h"
#include "fit/likelihood/wandering_force.h"

// The arithmetic behind RunResidual: rows of the linear unknowns, their elimination, and what theta does beside them.

namespace unrig {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::RowVectorXd;
using Eigen::VectorXd;

using run_rows::compress;
using run_rows::stacked;

VectorXd RunResidual::initial_state(const VectorXd& linear, Index states) const {
  VectorXd state = VectorXd::Zero(states);
  for (std::size_t i = 0; i < free_.size(); ++i)
    if (free_[i] < states) state[free_[i]] = linear[first_state_ + static_cast<Index>(i)];
  if (arrival_.rows() > 0) state += arrival_.value.col(0);
  return state;
}

Index RunResidual::longest_piece(bool moving) const {
  Index longest = 0;
  for (const Piece& piece : pieces_)
    if (piece.moving == moving) longest = std::max(longest, moving ? piece.samples.length() : counted(piece.samples).length());
  return longest;
}

void RunResidual::Linearised::settle(const std::vector<MatrixXd>& rows, Index unknowns, double unreachable) {
  const MatrixXd stack = stacked(rows, unknowns + 1);
  auto whole = std::make_unique<run_rows::ChainEliminator>(std::vector<run_rows::Link>{}, unknowns, MatrixXd(0, unknowns), unknowns, stack.leftCols(unknowns));
  const run_rows::ChainEliminator::Rotated right = whole->rotated({}, stack.rightCols(1));
  settle(std::move(whole), right, unreachable);
}

void RunResidual::Linearised::settle(std::unique_ptr<run_rows::ChainEliminator> chain, const run_rows::ChainEliminator::Rotated& right, double unreachable) {
  eliminate = std::move(chain);
  linear = eliminate->solve(right);
  chi2 = unreachable;
  for (const MatrixXd& beside : right.beside) chi2 += beside.squaredNorm();
}

std::shared_ptr<RunResidual::Linearised> RunResidual::linearise(const VectorXd& theta) const {
  auto lin = std::make_shared<Linearised>();
  lin->noise = Linearised::noise_through(*this, theta);
  std::unique_lock<std::mutex> lock;
  if (shared_) lock = std::unique_lock(shared_->in_use);
  const bool known = shared_ && shared_->rows && shared_->rows->theta == theta && shared_->rows->samples == samples_of_free_response();
  if (known) {
    const SharedResponses::Rows& rows = *shared_->rows;
    lin->system = rows.system, lin->step = rows.step, lin->free = rows.free, lin->leap = rows.leap;
  } else {
    lin->system = searched_system(theta);
    for (DualMatrix* m : {&lin->system.A, &lin->system.B, &lin->system.C, &lin->system.D}) m->partial.clear();
    lin->step = lin->system.feedback.empty() ? exact_step(lin->system, run_->dt) : step_to_follow(lin->system, run_->dt);
    filter_output(lin->system, lin->step);
    lin->wandering = Linearised::wander(*this, theta, lin->system, lin->step, Partials::none);
  }
  if (!lin->system.feedback.empty()) return lin;
  prepare_linear(*lin);
  if (shared_ && !known && !lin->wandering) shared_->rows = std::make_shared<const SharedResponses::Rows>(SharedResponses::Rows{theta, samples_of_free_response(), lin->system, lin->step, lin->free, lin->leap});
  return lin;
}

Index RunResidual::samples_of_free_response() const { return std::max(std::min(longest_piece(false), rest_rows::stretch_samples), longest_piece(true)); }

/// Responses that the rows of a linear system are made of.
void RunResidual::prepare_linear(Linearised& lin) const {
  if (inputs_.cols() > 0)
    lin.known = drive(lin.system, lin.step, DualMatrix(MatrixXd::Zero(lin.system.states(), 1)), run_->samples(), {}, inputs_, Partials::none).output;
  if (lin.free.empty()) {
    for (MatrixXd& rows : free_response_rows(lin.system, lin.step, samples_of_free_response())) lin.free.emplace_back(std::move(rows));
    lin.leap = power(lin.step.transition.value, rest_rows::stretch_samples);
  }
  lin.polynomials = inputs_.cols() == 0 && !lin.wandering;
  if (motion_.unknowns() > 0) {
    Index support = 0;
    for (const MotionBasis::Column& column : motion_.columns()) support = std::max<Index>(support, column.value.size() + 4 * longest_stride());
    lin.spline = spline_states(lin.step, longest_piece(true) + support + 1);
    lin.spline_summed = lin.spline;
    for (Index k = 1; k < lin.spline.cols(); ++k) lin.spline_summed.col(k) += lin.spline_summed.col(k - 1);
    lin.spline_output = product(lin.system.C.value, lin.spline);
    lin.spline_summed_output = product(lin.system.C.value, lin.spline_summed);
  }
}

/// The sample of a rest from which on nothing that c can do is more than a polynomial over whole stretches. Slopes in theta, t exp(-at) where c does
/// exp(-at), get a stretch more.
Index RunResidual::smooth_from(const Linearised& lin, const Interval& samples, const MatrixXd& start) const {
  constexpr Index length = rest_rows::stretch_samples;
  if (!lin.polynomials) return samples.last;
  MatrixXd state = start;
  for (Index first = samples.first; first + 2 * length <= samples.last; first += length, state = product(lin.leap, state))
    if (std::all_of(lin.free.begin(), lin.free.end(), [&](const rest_rows::FreeRows& free) { return free.is_smooth(state, start); })) return first + length;
  return samples.last;
}

/// The stretches of a block at rest: their rotations, and the rows that are kept.
MatrixXd RunResidual::rows_at_rest(const Linearised& lin, const Piece& piece, bool has_state, run_rows::Block& block) const {
  const rest_rows::FreeRows& free = lin.free[static_cast<std::size_t>(block.channel)];
  const Index n = lin.system.states();
  std::vector<MatrixXd> spans;
  MatrixXd since = MatrixXd::Identity(n, n), smooth_since;  // transition up to the stretch; with the polynomials of the response behind it
  for (Index first = block.samples.first; first < block.samples.last; first += rest_rows::stretch_samples) {
    const Interval stretch{first, std::min(first + rest_rows::stretch_samples, block.samples.last)};
    if (block.is_smooth(stretch)) {
      smooth_since = smooth_since.size() > 0 ? product(smooth_since, lin.leap) : product(free.smooth, since);
      const rest_rows::SmoothReadings& readings = smooth_readings(block.channel, stretch);
      MatrixXd span(rest_rows::smooth_terms, n + 1);
      span << readings.weight * smooth_since, readings.weight * rest_rows::smooth_constant();
      spans.push_back(std::move(span));
      block.add_smooth_stretch();
      continue;
    }
    // The broken stretch at the end of the rest.
    if (smooth_since.size() > 0) since = power(lin.step.transition.value, first - block.samples.first);
    const auto w = weight_.col(block.channel).segment(first, stretch.length());
    const MatrixXd offsets = lin.offset_columns(block.channel, stretch);
    MatrixXd span(stretch.length(), n + offsets.cols());
    if (!lin.wandering && free.rotation && stretch.length() == rest_rows::stretch_samples && w[0] > 0 && (w.array() == w[0]).all()) {
      span = block.add_stretch(w[0], free.rotation);
    } else {
      span << w.asDiagonal() * free.rows.topRows(stretch.length()), w.asDiagonal() * offsets;
      span = block.add_stretch(std::move(span));
    }
    span.leftCols(n) = product(span.leftCols(n), since);
    spans.push_back(std::move(span));
    since = product(since, lin.leap);
  }
  const MatrixXd span = block.join(spans);
  return link_rows(piece, has_state, {}, has_state ? MatrixXd(span.leftCols(n)) : MatrixXd(), span.rightCols(span.cols() - n), lin.offsets_from(*this, block.channel));
}

/// The weighted rows of a block in which the shaft moves: over the splines that act in it, the state at its start, and the offsets.
MatrixXd RunResidual::rows_in_motion(const Linearised& lin, const Piece& piece, bool has_state, run_rows::Block& block) const {
  const Interval& s = block.samples;
  const auto w = weight_.col(block.channel).segment(s.first, s.length());
  const Index acting = piece.splines.all(), n = has_state ? lin.system.states() : 0;
  const MatrixXd offsets = lin.offset_columns(block.channel, s);
  MatrixXd span(s.length(), acting + n + offsets.cols());
  span << motion_output_columns(lin, block.channel, s, piece.splines), lin.free[static_cast<std::size_t>(block.channel)].rows.topLeftCorner(s.length(), n), offsets;
  span = w.asDiagonal() * span;
  if (span.rows() > 2 * span.cols()) span = block.add_stretch(std::move(span));
  return link_rows(piece, has_state, span.leftCols(acting), span.middleCols(acting, n), span.rightCols(offsets.cols()), lin.offsets_from(*this, block.channel));
}

/// Weighted readings of a block on their way through its rotations, without what the inputs do.
run_rows::Rotated RunResidual::rotated_readings(const Linearised& lin, const run_rows::Block& block, double& beside) const {
  run_rows::Rotated rotated;
  const Interval& s = block.samples;
  const Index length = block.moving ? s.length() : rest_rows::stretch_samples;
  for (Index first = s.first; first < s.last; first += length) {
    const Interval stretch{first, std::min(first + length, s.last)};
    if (block.is_smooth(stretch)) {
      const rest_rows::SmoothReadings& readings = smooth_readings(block.channel, stretch);
      block.rotate(stretch, readings.reading, rotated);
      beside += readings.beside;
      continue;
    }
    VectorXd y = lin.readings(*this).col(block.channel).segment(first, stretch.length());
    if (lin.known.size() > 0) y -= lin.known.col(block.channel).segment(first, stretch.length());
    block.rotate(stretch, weight_.col(block.channel).segment(first, stretch.length()).cwiseProduct(y), rotated);
  }
  return rotated;
}

/// One stretch of readings at rest against polynomials; it does not depend on theta.
const rest_rows::SmoothReadings& RunResidual::smooth_readings(Index channel, const Interval& stretch) const {
  const std::pair<Index, Index> key{channel, stretch.first};
  const auto known = smooth_readings_.find(key);
  if (known != smooth_readings_.end()) return known->second;
  return smooth_readings_
      .emplace(key, rest_rows::smooth_readings(weight_.col(channel).segment(stretch.first, stretch.length()), readings().col(channel).segment(stretch.first, stretch.length())))
      .first->second;
}

/// The rows of all pieces, those at rest rotated and cut to what c can reach; solves for c. What the state that the run arrived in does lies in the span of the free response: it is taken
/// from the readings behind the rotations.
void RunResidual::stack_rows(Linearised& lin) const {
  MatrixXd start = MatrixXd::Zero(lin.system.states(), unknowns_ + arrival_.cols());
  for (std::size_t i = 0; i < free_.size(); ++i) start(free_[i], first_state_ + static_cast<Index>(i)) = 1;
  if (lin.noise) {
    const MatrixXd from = start.leftCols(unknowns_);
    lin.settle_white(*this, from, free_response_rows(lin.system, lin.step, last_sample_), measured_.topRows(last_sample_) - lin.known.topRows(last_sample_));
    lin.end = power(lin.step.transition.value, last_sample_) * from;
    return;
  }
  if (arrival_.cols() > 0) start.rightCols(1) = arrival_.value;
  Linearised::Rows rows(*this, is_linked());
  bool moved = has_state(pieces_.front(), start);
  if (moved) rows.begin(start);
  double unreachable = 0;
  MatrixXd leap;
  Index leaps = -1;  // so many samples
  const std::size_t count = counted_pieces();
  for (std::size_t p = 0; p < count; ++p) {
    const Piece& piece = pieces_[p];
    const Interval s = counted(piece.samples);
    moved = moved || piece.splines.begin > 0;  // whatever an unstable model makes of nothing
    const Index smooth = piece.moving || s.length() <= 0 ? s.last : smooth_from(lin, s, start);
    for (Index c = 0; c < measured_.cols() && s.length() > 0; ++c) {
      run_rows::Block block{s, piece.moving, c, start, {}, smooth};
      const MatrixXd of_link = piece.moving ? rows_in_motion(lin, piece, moved, block) : rows_at_rest(lin, piece, moved, block);
      run_rows::Rotated rotated = rotated_readings(lin, block, unreachable);
      MatrixXd right = block.reached(rotated);
      if (arrival_.cols() > 0 && moved) right -= of_link.middleCols(piece.splines.own(), start.rows()) * start.rightCols(1);
      for (const MatrixXd& others : rotated.others) unreachable += others.squaredNorm();
      rows.add(moved, of_link, right, start);
      lin.blocks.push_back(std::move(block));
    }
    if (s.length() > 0 && s.length() != leaps) leap = power(lin.step.transition.value, leaps = s.length());
    MatrixXd moves;
    if (!rows.is_last() && (moved || piece.splines.end > 0)) {
      const Splines& next = pieces_[p + 1].splines;
      moves = transition(piece, moved, next, leap, motion_states(lin, piece.splines.still, next.still, piece.samples.last));
      if (piece.moving) {  // what the splines do that act still is added as long as they do: without them the shaft stands
        moves.row(lin.system.motion) = moves.row(lin.system.states());
        moves.middleRows(lin.system.motion + 1, 2).setZero();
      }
    }
    rows.end_piece(moved, std::move(moves));
    if (s.length() > 0) start = state_behind(lin, piece, s, leap, start);
  }
  lin.end = start;
  rows.settle(lin, unreachable);
}

RunResidual::Solution RunResidual::solve(const VectorXd& theta) const {
  if (last_solution_.model && last_solution_.theta == theta) return last_solution_;
  const std::shared_ptr<Linearised> lin = linearise(theta);
  if (!lin->system.feedback.empty()) {
    solve_nonlinear(*lin, theta);
    const Solution solution{theta, lin->chi2, lin->linear, lin};
    last_evaluation_ = {};
    last_solution_ = lin->settled ? solution : Solution{};
    return solution;
  }
  stack_rows(*lin);
  last_evaluation_ = {};
  VectorXd departure = lin->end.leftCols(unknowns_) * lin->linear;
  if (arrival_.cols() > 0) departure += lin->end.rightCols(1);
  return last_solution_ = {theta, lin->chi2, lin->linear, lin, std::move(departure)};
}

/// The model's system, corners of its laws rounded where they have any.
LinearSystem RunResidual::searched_system(const VectorXd& theta) const {
  LinearSystem system = model_->system(conditions_, theta, channels_);
  for (Feedback& f : system.feedback) {
    if (f.rounded) f.law = f.rounded;
    f.steps_per_sample = glance_ ? finer_ : finer_ * f.steps_per_sample;
  }
  return system;
}

/// With the partials of these parameters alone; none: of all.
LinearSystem RunResidual::differentiable_system(const VectorXd& theta, const std::vector<Index>& parameters) const {
  LinearSystem system = searched_system(theta);
  if (parameters.empty()) return system;
  for (DualMatrix* m : {&system.A, &system.B, &system.C, &system.D})
    for (Index j = 0; j < m->parameters(); ++j)
      if (std::find(parameters.begin(), parameters.end(), j) == parameters.end()) m->partial[static_cast<std::size_t>(j)].resize(0, 0);
  return system;
}

namespace {

/// What the parameters do to one channel over a phase at fixed c, beside its prediction: [d y / d theta | y].
MatrixXd slopes_and_prediction(const Response& response, const Response& known, const Interval& s, Index channel, Index parameters) {
  MatrixXd m = MatrixXd::Zero(response.output.rows(), parameters + 1);
  m.col(parameters) = response.output.col(channel);
  if (known.output.size() > 0) m.col(parameters) += known.output.col(channel).segment(s.first, s.length());
  for (Index j = 0; j < parameters; ++j) {
    const auto index = static_cast<std::size_t>(j);
    if (index < response.partial.size() && response.partial[index].size() > 0) m.col(j) += response.partial[index].col(channel);
    if (index < known.partial.size() && known.partial[index].size() > 0) m.col(j) += known.partial[index].col(channel).segment(s.first, s.length());
  }
  return m;
}

/// The offsets behind the filter of a wandering force, and what the parameters do to that: it takes from the readings what it adds here.
void add_readings(const WanderingForce& wandering, const VectorXd& offset, Index channel, const Interval& s, MatrixXd& m) {
  const Index parameters = m.cols() - 1;
  m.col(parameters) += wandering.raised(channel).middleRows(s.first, s.length()) * offset;
  for (Index j = 0; j < parameters; ++j)
    if (const VectorXd slope = wandering.slope(j, channel, offset); slope.size() > 0) m.col(j) -= slope.segment(s.first, s.length());
}

}  // namespace

/// Follows the model with its partials through all phases at fixed c, and hands [d y / d theta | y] of each channel to `take`, piece by piece. Stretches that are
/// smooth in `blocks` are handed on as coefficients of polynomials; none where there are no blocks. Returns the state behind the last sample, of a linear model.
DualMatrix RunResidual::follow_partials(const VectorXd& theta, const VectorXd& linear, const std::vector<run_rows::Block>& blocks, const TakeRows& take) const {
  std::shared_ptr<const SharedResponses::Slopes> at;
  if (shared_) {
    const std::lock_guard lock(shared_->in_use);
    at = shared_->slopes;
  }
  if (!at || at->theta != theta || at->differentiated != differentiated_) {
    LinearSystem system = differentiable_system(theta, differentiated_);
    if (!system.feedback.empty()) {
      follow_nonlinear_partials(system, theta, linear, take);
      return {};
    }
    ExactStep step = exact_step(system, run_->dt);
    filter_output(system, step);
    std::shared_ptr<const WanderingForce> wandering = Linearised::wander(*this, theta, system, step, Partials::all);
    for (Index j = 0; j < step.transition.parameters(); ++j)  // responses follow what moves the system
      if (step.transition.depends_on(j) && !system.A.depends_on(j)) system.A.add_partial(j, MatrixXd::Zero(system.states(), system.states()));
    FreeResponse free(system, step, Partials::all);
    std::optional<rest_rows::SmoothResponse> smooth;
    if (shared_ || std::any_of(blocks.begin(), blocks.end(), [](const run_rows::Block& block) { return !block.moving && block.smooth_from < block.samples.last; })) smooth.emplace(free);
    at = std::make_shared<const SharedResponses::Slopes>(SharedResponses::Slopes{theta, differentiated_, std::move(system), std::move(step), std::move(free), std::move(smooth), std::move(wandering)});
    if (shared_ && !at->wandering) {  // its innovations are those of this run's readings
      const std::lock_guard lock(shared_->in_use);
      shared_->slopes = at;
    }
  }
  const auto& [its_theta, differentiated, system, step, free, smooth, wandering] = *at;
  const auto parameters = static_cast<Index>(model_->parameters().size());
  const Index channels = measured_.cols();
  Response known;
  if (inputs_.cols() > 0) known = drive(system, step, DualMatrix(MatrixXd::Zero(system.states(), 1)), run_->samples(), {}, inputs_, Partials::all);
  DualMatrix state(MatrixXd::Zero(system.states(), 1), parameters);
  state.value.col(0) = initial_state(linear, system.states());
  if (arrival_.parameters() > 0) state.partial = arrival_.partial;
  const Motion motion = motion_.unknowns() > 0 ? motion_of(motion_.coefficients(linear.head(motion_.unknowns())), run_->dt) : Motion{};
  std::size_t block = 0;
  for (const Piece& piece : pieces_) {
    const Interval s = counted(piece.samples);
    if (s.length() <= 0) break;
    const Index length = piece.moving ? s.length() : rest_rows::stretch_samples;
    for (Index first = s.first; first < s.last; first += length) {
      const Interval stretch{first, std::min(first + length, s.last)};
      const bool is_smooth = !blocks.empty() && blocks[block].is_smooth(stretch);
      const Response response = is_smooth        ? smooth->from(state)
                                : piece.moving ? drive(system, step, state, stretch.length(), motion.jerk.segment(first, stretch.length()), {}, Partials::all)
                                                 : free.from(state, stretch.length());
      state = response.end;
      if (piece.stands_still && stretch.last < run_->samples()) stand_still(state.value, system.motion, RowVectorXd::Constant(1, motion.angle[stretch.last] + arrival_angle(system)));
      for (Index c = 0; c < channels; ++c) {
        MatrixXd m = slopes_and_prediction(response, known, stretch, c, parameters);
        if (wandering) add_readings(*wandering, linear.segment(first_offset_, channels), c, stretch, m);
        else m.col(parameters) += linear[first_offset_ + c] * (is_smooth ? rest_rows::smooth_constant() : VectorXd::Ones(stretch.length()));
        take(block + static_cast<std::size_t>(c), stretch, std::move(m));
      }
    }
    block += static_cast<std::size_t>(channels);
  }
  return state;
}

namespace {

/// Of a model that runs away from every c that was tried.
RunResidual::Evaluation says_nothing(Index parameters, Index unknowns) {
  RunResidual::Evaluation e;
  e.chi2 = INFINITY;
  e.residual = VectorXd::Constant(parameters + 1, INFINITY);
  e.jacobian = MatrixXd::Zero(parameters + 1, parameters);
  e.linear = VectorXd::Zero(unknowns);
  e.linear_slope = MatrixXd::Zero(unknowns, parameters);
  return e;
}

/// Rows [slopes | left] that hold what c leaves of what no theta moves.
MatrixXd of_constant(const VectorXd& left, Index columns) {
  MatrixXd rows = MatrixXd::Zero(left.size(), columns);
  rows.rightCols(1) = left;
  return rows;
}

}  // namespace

/// What the channels' blocks reach and what c leaves of angle and prior, on their way through the links.
run_rows::ChainEliminator::Rotated RunResidual::Linearised::rotated_links(const RunResidual& run, const std::vector<MatrixXd>& reached, Index columns) const {
  const std::size_t count = run.counted_pieces(), channels = static_cast<std::size_t>(run.measured_.cols());
  std::vector<MatrixXd> right(count);
  for (std::size_t p = 0, b = 0; p < count; ++p) {
    std::vector<MatrixXd> of_link;
    for (std::size_t c = 0; c < channels && b < reached.size(); ++c) of_link.push_back(reached[b++]);
    if (!run.angle_rows_.empty()) of_link.push_back(of_constant(run.angle_residual(p, linear), columns));
    if (!run.prior_rows_.empty()) of_link.push_back(of_constant(-run.prior_rows_[p] * linear.segment(run.pieces_[p].splines.still, run.pieces_[p].splines.all()), columns));
    right[p] = stacked(of_link, columns);
  }
  const MatrixXd colour = run.colour_rows();
  return eliminate->rotated(std::move(right), of_constant(colour.col(run.unknowns_) - colour.leftCols(run.unknowns_) * linear, columns));
}

/// The same where the rows are over all of c.
run_rows::ChainEliminator::Rotated RunResidual::Linearised::rotated_whole(const RunResidual& run, std::vector<MatrixXd> reached, Index columns) const {
  const MatrixXd angle = run.angle_rows();
  reached.push_back(of_constant(angle.col(run.unknowns_) - angle.leftCols(run.unknowns_) * linear, columns));
  return eliminate->rotated({}, stacked(reached, columns));
}

RunResidual::Evaluation RunResidual::differentiate(const Solution& solution) const {
  const bool is_last = solution.model == last_solution_.model;
  if (is_last && last_evaluation_.residual.size() > 0) return last_evaluation_;
  const Linearised& lin = *solution.model;
  const auto parameters = static_cast<Index>(model_->parameters().size());
  if (!std::isfinite(solution.chi2)) return says_nothing(parameters, unknowns_);
  const bool coloured = lin.noise != nullptr;
  std::vector<run_rows::Rotated> rotated_blocks(coloured ? 0 : lin.blocks.size());
  double beside = 0;
  MatrixXd whole = MatrixXd::Zero(coloured ? last_sample_ * measured_.cols() : 0, parameters + 1);
  DualMatrix departure = follow_partials(solution.theta, solution.linear, coloured ? std::vector<run_rows::Block>{} : lin.blocks, [&](std::size_t b, const Interval& s, MatrixXd m) {
    // Residual and its derivative, weighted: [-d y / d theta | measured - y].
    m = -m;
    if (coloured) {
      const Index c = static_cast<Index>(b) % measured_.cols();
      m.col(parameters) += measured_.col(c).segment(s.first, s.length());
      whole.middleRows(c * last_sample_ + s.first, s.length()) = m;
      return;
    }
    const run_rows::Block& block = lin.blocks[b];
    if (block.is_smooth(s)) {
      const rest_rows::SmoothReadings& readings = smooth_readings(block.channel, s);
      m = readings.weight * m;
      m.col(parameters) += readings.reading;
      beside += readings.beside;
    } else {
      m.col(parameters) += lin.readings(*this).col(block.channel).segment(s.first, s.length());
      m = weight_.col(block.channel).segment(s.first, s.length()).asDiagonal() * m;
    }
    block.rotate(s, std::move(m), rotated_blocks[b]);
  });
  std::vector<MatrixXd> reached, others{std::sqrt(beside) * RowVectorXd::Unit(parameters + 1, parameters)};
  if (coloured) reached.push_back(lin.white_slopes(*this, solution.theta, std::move(whole)));
  for (std::size_t b = 0; b < rotated_blocks.size(); ++b) {
    reached.push_back(lin.blocks[b].reached(rotated_blocks[b]));
    others.insert(others.end(), rotated_blocks[b].others.begin(), rotated_blocks[b].others.end());
  }
  const run_rows::ChainEliminator::Rotated rotated = lin.linked ? lin.rotated_links(*this, reached, parameters + 1) : lin.rotated_whole(*this, std::move(reached), parameters + 1);
  others.insert(others.end(), rotated.beside.begin(), rotated.beside.end());
  const MatrixXd triangle = compress(stacked(others, parameters + 1));

  Evaluation e;
  e.linear = solution.linear;
  e.linear_slope = lin.eliminate->solve(rotated).leftCols(parameters);
  e.residual = VectorXd::Zero(parameters + 1);
  e.jacobian = MatrixXd::Zero(parameters + 1, parameters);
  e.jacobian.topRows(triangle.rows()) = triangle.leftCols(parameters);
  e.residual.head(triangle.rows()) = triangle.col(parameters);
  e.chi2 = e.residual.squaredNorm();
  if (departure.rows() > 0) {
    const MatrixXd followed = lin.end.leftCols(unknowns_) * e.linear_slope;
    for (Index j = 0; j < parameters; ++j)
      if (!followed.col(j).isZero(0)) departure.add_partial(j, followed.col(j));
    e.departure = std::move(departure);
  }
  if (!solution.model->system.feedback.empty()) guide_ = {solution.theta, e.linear, e.linear_slope, solution.chi2};
  if (is_last) last_evaluation_ = e;
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

}  // namespace unrig
