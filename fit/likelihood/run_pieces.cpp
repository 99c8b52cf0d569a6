#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>

#include "core/numerics/product.h"
#include "fit/likelihood/run_linearised.h"

// The pieces of a run: which splines act in each and what they do, what is known of the angle there, and how its rows become a link of the elimination.

namespace unrig {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::RowVectorXd;
using Eigen::VectorXd;

using run_rows::stacked;

Index RunResidual::longest_stride() const {
  Index stride = 1;
  for (const MotionBasis::Window& window : motion_.windows()) stride = std::max(stride, window.stride);
  return stride;
}

/// Long motions in pieces of so many knots, which the elimination takes one by one.
void RunResidual::cut_phases() {
  constexpr Index knots = 32;
  const Index stride = longest_stride();
  pieces_.clear();
  for (const MotionBasis::Phase& phase : phases_) {
    const Index length = phase.samples.length(), count = phase.moving ? std::max<Index>(1, length / (knots * stride)) : 1, each = (length + count - 1) / count;
    for (Index first = phase.samples.first; first < phase.samples.last; first += each) {
      const Interval samples{first, std::min(first + each, phase.samples.last)};
      pieces_.push_back({samples, phase.moving, phase.moving && samples.last == phase.samples.last, splines_in(samples)});
    }
  }
}

/// The first spline that does not stand still before a sample: while the shaft moves neither those that fourth differences of the coefficients (fit/likelihood/motion_prior.h) hold together with what begins there.
Index RunResidual::first_open(Index at) const {
  const std::vector<MotionBasis::Column>& columns = motion_.columns();
  const bool moves = std::any_of(phases_.begin(), phases_.end(), [&](const MotionBasis::Phase& phase) { return phase.moving && phase.samples.first < at && at < phase.samples.last; });
  const Index reach = moves ? 4 * longest_stride() : 3;
  const auto still = [&](const MotionBasis::Column& column) { return column.first + column.value.size() + reach <= at; };
  return std::find_if_not(columns.begin(), columns.end(), still) - columns.begin();
}

RunResidual::Splines RunResidual::splines_in(const Interval& samples) const {
  const auto begins_before = [](const MotionBasis::Column& column, Index sample) { return column.first < sample; };
  const auto place = [&](Index sample) { return std::lower_bound(motion_.columns().begin(), motion_.columns().end(), sample, begins_before) - motion_.columns().begin(); };
  return {first_open(samples.first), place(samples.first), place(samples.last)};
}

/// Rows of the angle channel. Where the angle is constant all rows are alike and are one row with their common weight, besides a row for their scatter.
void RunResidual::prepare_angle_rows() {
  forget_solutions();
  angle_rows_.clear();
  if (angle_offset_ < 0) return;
  for (const Piece& piece : pieces_) {
    const Interval& s = piece.samples;
    const auto w = angle_weight_.segment(s.first, s.length());
    const auto y = angle_.segment(s.first, s.length());
    if (piece.moving) {
      MatrixXd span(s.length(), piece.splines.all() + 3);
      span << motion_.angle_columns(s, piece.splines.still, piece.splines.end), VectorXd::Ones(s.length()), VectorXd::Ones(s.length()), y;
      span = w.asDiagonal() * span;
      if (span.rows() > 2 * span.cols()) span = run_rows::compress(std::move(span));
      angle_rows_.push_back(std::move(span));
      continue;
    }
    const double total = w.squaredNorm(), root = std::sqrt(total), mean = total > 0 ? w.cwiseAbs2().dot(y) / total : 0;
    MatrixXd rows(2, 3);
    rows << root, root, root * mean, 0, 0, std::sqrt((w.array() * (y.array() - mean)).square().sum());
    angle_rows_.push_back(std::move(rows));
  }
}

/// d angle / d c of the splines that stand still before this one acts.
RowVectorXd RunResidual::level_before(Index spline) const {
  RowVectorXd level(spline);
  for (Index j = 0; j < spline; ++j) level[j] = motion_.columns()[static_cast<std::size_t>(j)].tail;
  return level;
}

RunResidual::MotionRows RunResidual::by_piece(MatrixXd rows) const {
  MotionRows parted{{}, std::vector<std::vector<Index>>(pieces_.size()), std::move(rows)};
  for (Index row = 0; row < parted.all.rows(); ++row) {
    if (parted.all.row(row).isZero(0)) continue;
    Index first = 0, last = parted.all.cols() - 1;
    while (first < last && parted.all(row, first) == 0) ++first;
    while (first < last && parted.all(row, last) == 0) --last;
    const auto piece = std::find_if(pieces_.begin(), pieces_.end(), [&](const Piece& p) { return p.moving && p.splines.still <= first && p.splines.begin <= last && last < p.splines.end; });
    if (piece == pieces_.end()) return parted;
    parted.number[static_cast<std::size_t>(piece - pieces_.begin())].push_back(row);
  }
  for (std::size_t p = 0; p < pieces_.size(); ++p) {
    const Splines& splines = pieces_[p].splines;
    parted.rows.emplace_back(static_cast<Index>(parted.number[p].size()), splines.all());
    for (std::size_t i = 0; i < parted.number[p].size(); ++i) parted.rows.back().row(static_cast<Index>(i)) = parted.all.row(parted.number[p][i]).segment(splines.still, splines.all());
  }
  return parted;
}

/// Link by link; where c was eliminated as a whole, all at once.
RunResidual::HeldMotion RunResidual::hold_motion(const Solution& solution, const MotionRows& rows, const VectorXd& scale) const {
  const Linearised& lin = *solution.model;
  HeldMotion result{{}, VectorXd::Zero(rows.all.rows())};
  if (!lin.linked || rows.rows.empty()) {
    MatrixXd all = MatrixXd::Zero(rows.all.rows(), unknowns_);
    all.leftCols(rows.all.cols()) = scale.asDiagonal() * rows.all;
    const run_rows::ChainEliminator whole({}, unknowns_, MatrixXd(0, unknowns_), unknowns_, lin.eliminate->factor());
    auto [chain, linear] = whole.held(solution.linear, {}, all);
    result.linear = std::move(linear);
    result.variance = product(all, chain.covariance_roots().back()).rowwise().squaredNorm();
    return result;
  }
  const std::size_t count = lin.eliminate->links();
  std::vector<MatrixXd> further;
  for (std::size_t p = 0; p < count; ++p) {
    const MatrixXd own = scale(rows.number[p]).asDiagonal() * rows.rows[p];
    further.push_back(link_rows(pieces_[p], lin.eliminate->has_state(p), own, {}, MatrixXd(own.rows(), 0), first_offset_));
  }
  auto [chain, linear] = lin.eliminate->held(solution.linear, further, MatrixXd(0, unknowns_ - first_state_));
  result.linear = std::move(linear);
  const std::vector<MatrixXd> roots = chain.covariance_roots();
  for (std::size_t p = count; p < pieces_.size(); ++p)  // behind the last reading: as open as these rows leave it
    for (const Index row : rows.number[p]) result.variance[row] = 1;
  for (std::size_t p = 0; p < count; ++p) {
    const VectorXd variance = product(further[p].leftCols(roots[p].rows()), roots[p]).rowwise().squaredNorm();
    for (std::size_t i = 0; i < rows.number[p].size(); ++i) result.variance[rows.number[p][i]] = variance[static_cast<Index>(i)];
  }
  return result;
}

/// [c | reading] of what is known of c beside the channels: the prior on the motion, and the noise's own state.
MatrixXd RunResidual::held_rows() const { return run_rows::stacked({motion_prior_.rows() > 0 ? motion_prior_ : MatrixXd(0, unknowns_ + 1), colour_rows()}, unknowns_ + 1); }

VectorXd RunResidual::held_residual(const VectorXd& linear) const {
  const MatrixXd rows = held_rows();
  return rows.col(unknowns_) - rows.leftCols(unknowns_) * linear;
}

/// [c | angle], all that is known of c beside the fitted channels.
MatrixXd RunResidual::angle_rows() const {
  std::vector<MatrixXd> all{held_rows()};
  for (std::size_t p = 0; p < angle_rows_.size(); ++p) {
    const Splines& splines = pieces_[p].splines;
    const MatrixXd& own = angle_rows_[p];
    MatrixXd rows = MatrixXd::Zero(own.rows(), unknowns_ + 1);
    rows.leftCols(splines.still) = own.col(splines.all()) * level_before(splines.still);
    rows.middleCols(splines.still, splines.all()) = own.leftCols(splines.all());
    rows.col(angle_offset_) = own.col(splines.all() + 1);
    rows.col(unknowns_) = own.col(splines.all() + 2);
    all.push_back(std::move(rows));
  }
  return run_rows::stacked(all, unknowns_ + 1);
}

/// What c leaves of the angle in one piece.
VectorXd RunResidual::angle_residual(std::size_t piece, const VectorXd& linear) const {
  const Splines& splines = pieces_[piece].splines;
  const MatrixXd& rows = angle_rows_[piece];
  const double level = level_before(splines.still) * linear.head(splines.still);
  return rows.col(splines.all() + 2) - rows.leftCols(splines.all()) * linear.segment(splines.still, splines.all()) - level * rows.col(splines.all()) - linear[angle_offset_] * rows.col(splines.all() + 1);
}

/// d output / d motion unknowns over samples in which the shaft moves, of the splines that act in them: the response to one spline, shifted.
MatrixXd RunResidual::motion_output_columns(const Linearised& lin, Index channel, const Interval& samples, const Splines& splines) const {
  MatrixXd columns = MatrixXd::Zero(samples.length(), splines.all());
  for (Index j = 0; j < columns.cols(); ++j) {
    const MotionBasis::Column& column = motion_.columns()[static_cast<std::size_t>(splines.still + j)];
    const auto add = [&](const MatrixXd& response, Index knot, double amount) {
      const Index from = std::max(knot + 1, samples.first), count = samples.last - from;
      if (amount == 0 || count <= 0) return;
      columns.col(j).tail(count) += amount * response.row(channel).segment(from - knot, count).transpose();
    };
    for (Index i = 0; i < column.value.size(); ++i) add(lin.spline_output, column.first + i, column.value[i]);
    add(lin.spline_summed_output, column.first + column.value.size(), column.tail);
  }
  return columns;
}

/// d state / d a motion unknown, by its spline alone, at a sample.
VectorXd RunResidual::motion_state(const Linearised& lin, Index spline, Index at) const {
  const MotionBasis::Column& column = motion_.columns()[static_cast<std::size_t>(spline)];
  VectorXd state = VectorXd::Zero(lin.spline.rows());
  for (Index i = 0; i < column.value.size() && column.first + i < at; ++i) state += column.value[i] * lin.spline.col(at - column.first - i);
  const Index since_tail = at - column.first - column.value.size();
  if (column.tail != 0 && since_tail > 0) state += column.tail * lin.spline_summed.col(since_tail);
  return state;
}

/// The same of splines [first, last), a column each.
MatrixXd RunResidual::motion_states(const Linearised& lin, Index first, Index last, Index at) const {
  MatrixXd states(lin.spline.rows(), last - first);
  for (Index j = first; j < last; ++j) states.col(j - first) = motion_state(lin, j, at);
  return states;
}

/// d state / d c behind a piece, from that at its start: by the splines that stand still there, or, where the record ends, by all.
MatrixXd RunResidual::state_behind(const Linearised& lin, const Piece& piece, const Interval& samples, const MatrixXd& leap, const MatrixXd& start) const {
  MatrixXd behind = product(leap, start);
  if (!piece.moving) return behind;
  const bool ends = samples.last == run_->samples();
  const Index last = ends ? piece.splines.end : std::min(first_open(samples.last), piece.splines.end);
  behind.middleCols(piece.splines.still, last - piece.splines.still) += motion_states(lin, piece.splines.still, last, samples.last);
  if (ends || motion_.unknowns() == 0) return behind;
  RowVectorXd angle = RowVectorXd::Zero(start.cols());
  angle.head(last) = level_before(last);
  angle.tail(start.cols() - unknowns_).setConstant(arrival_angle(lin.system));
  stand_still(behind, lin.system.motion, angle);
  return behind;
}

/// The state [x | level of the angle | splines that act still] behind a piece over [its own splines | that at its start]. `leap`: x there over x at the start; `by_splines`: over the first of those that act.
MatrixXd RunResidual::transition(const Piece& piece, bool has_state, const Splines& next, const MatrixXd& leap, const MatrixXd& by_splines) const {
  const Splines& here = piece.splines;
  const Index n = by_splines.rows(), own = here.own();
  const auto place = [&](Index spline) { return spline >= here.begin ? spline - here.begin : own + n + 1 + spline - here.still; };
  MatrixXd moves = MatrixXd::Zero(n + 1 + next.open(), own + (has_state ? n + 1 + here.open() : 0));
  if (has_state) {
    moves.block(0, own, n, n) = leap;
    moves(n, own + n) = 1;
  }
  for (Index j = 0; j < by_splines.cols(); ++j) moves.col(place(here.still + j)).head(n) = by_splines.col(j);
  for (Index j = here.still; j < next.still; ++j) moves(n, place(j)) = motion_.columns()[static_cast<std::size_t>(j)].tail;
  for (Index j = next.still; j < next.begin; ++j) moves(n + 1 + j - next.still, place(j)) = 1;
  return moves;
}

/// Rows over [own splines | state | offsets, angle before the motion] of a link, from those over the splines that act (or none), the model's states (or none), and some of the last ones.
MatrixXd RunResidual::link_rows(const Piece& piece, bool has_state, const MatrixXd& acting, const MatrixXd& states, const MatrixXd& shared, Index first_shared) const {
  const Splines& splines = piece.splines;
  const Index own = splines.own(), open = splines.open(), ends = unknowns_ - first_offset_, n = states_ + filter_states(), level = motion_.unknowns() > 0 ? 1 : 0;
  MatrixXd rows = MatrixXd::Zero(shared.rows(), own + (has_state ? n + level + open : 0) + ends);
  if (acting.size() > 0) {
    rows.leftCols(own) = acting.middleCols(open, own);
    if (has_state) rows.middleCols(own + n + 1, open) = acting.leftCols(open);
    if (has_state && acting.cols() > open + own) rows.col(own + n) = acting.col(open + own);  // level
  }
  if (states.size() > 0) rows.middleCols(own, n) = states;
  rows.middleCols(rows.cols() - ends + first_shared - first_offset_, shared.cols()) = shared;
  return rows;
}

/// A link's rows over all of c.
MatrixXd RunResidual::over_c(const Piece& piece, bool has_state, const MatrixXd& rows, const MatrixXd& start) const {
  const Splines& splines = piece.splines;
  const Index own = splines.own(), open = splines.open(), ends = unknowns_ - first_offset_, n = start.rows();
  MatrixXd all = MatrixXd::Zero(rows.rows(), unknowns_);
  if (has_state) {
    all = product(rows.middleCols(own, n), start.leftCols(unknowns_));
    if (motion_.unknowns() > 0) {
      all.leftCols(splines.still) += rows.col(own + n) * level_before(splines.still);
      all.middleCols(splines.still, open) += rows.middleCols(own + n + 1, open);
    }
  }
  all.middleCols(splines.begin, own) += rows.leftCols(own);
  all.rightCols(ends) += rows.rightCols(ends);
  return all;
}

/// Pieces up to the last that says anything.
std::size_t RunResidual::counted_pieces() const {
  std::size_t count = pieces_.size();
  while (count > 0 && counted(pieces_[count - 1].samples).length() <= 0 && (angle_rows_.empty() || angle_rows_[count - 1].isZero(0)) && (prior_rows_.empty() || prior_rows_[count - 1].rows() == 0)) --count;
  return count;
}

RunResidual::Linearised::Rows::Rows(const RunResidual& run, bool linked)
    : run_(run), begin_(0, run.unknowns_ - run.first_state_), links_(run.counted_pieces()), right_(links_.size()), linked_(linked) {}

void RunResidual::Linearised::Rows::begin(const MatrixXd& start) {
  begin_ = MatrixXd::Zero(start.rows() + (run_.motion_.unknowns() > 0 ? 1 : 0), begin_.cols());
  begin_.topRows(start.rows()) = start.middleCols(run_.first_state_, begin_.cols());
}

void RunResidual::Linearised::Rows::add(bool has_state, const MatrixXd& of_link, const MatrixXd& right, const MatrixXd& start) {
  if (linked_) {
    own_.push_back(of_link);
    own_right_.push_back(right);
    return;
  }
  whole_.emplace_back(of_link.rows(), run_.unknowns_ + 1);
  whole_.back() << run_.over_c(run_.pieces_[at_], has_state, of_link, start), right;
}

void RunResidual::Linearised::Rows::end_piece(bool has_state, MatrixXd transition) {
  const Piece& piece = run_.pieces_[at_];
  if (linked_) {
    if (!run_.angle_rows_.empty()) {
      const MatrixXd& angle = run_.angle_rows_[at_];
      const Index acting = piece.splines.all();
      own_.push_back(run_.link_rows(piece, has_state, angle.leftCols(acting + 1), {}, angle.middleCols(acting + 1, 1), run_.angle_offset_));
      own_right_.push_back(angle.rightCols(1));
    }
    if (!run_.prior_rows_.empty()) {
      const MatrixXd& prior = run_.prior_rows_[at_];
      own_.push_back(run_.link_rows(piece, has_state, prior, {}, MatrixXd(prior.rows(), 0), run_.first_offset_));
      own_right_.push_back(MatrixXd::Zero(prior.rows(), 1));
    }
    links_[at_] = {piece.splines.begin, piece.splines.own(), stacked(own_, own_.front().cols()), std::move(transition)};
    right_[at_] = stacked(own_right_, 1);
  }
  own_.clear();
  own_right_.clear();
  ++at_;
}

void RunResidual::Linearised::Rows::settle(Linearised& lin, double unreachable) {
  lin.linked = linked_;
  if (!linked_) {
    whole_.push_back(run_.angle_rows());
    lin.settle(whole_, run_.unknowns_, unreachable);
    return;
  }
  const MatrixXd held = run_.colour_rows();
  auto chain = std::make_unique<run_rows::ChainEliminator>(std::move(links_), run_.unknowns_, begin_, run_.unknowns_ - run_.first_offset_, held.middleCols(run_.first_state_, begin_.cols()));
  const run_rows::ChainEliminator::Rotated right = chain->rotated(std::move(right_), held.rightCols(1));
  lin.settle(std::move(chain), right, unreachable);
}

}  // namespace unrig
