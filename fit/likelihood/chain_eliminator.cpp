#include "fit/likelihood/chain_eliminator.h"

#include <utility>

#include "core/numerics/product.h"

namespace unrig::run_rows {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

MatrixXd below(const MatrixXd& top, const MatrixXd& bottom) {
  MatrixXd both(top.rows() + bottom.rows(), top.cols());
  both << top, bottom;
  return both;
}

/// Rows over [state | shared] as rows over what the state comes of, and the shared unknowns.
MatrixXd through(const MatrixXd& rows, Index shared, const MatrixXd& transition, Index columns) {
  MatrixXd passed = MatrixXd::Zero(rows.rows(), columns + shared);
  if (transition.size() > 0) passed.leftCols(columns) = product(rows.leftCols(transition.rows()), transition);
  passed.rightCols(shared) = rows.rightCols(shared);
  return passed;
}

}  // namespace

ChainEliminator::ChainEliminator(std::vector<Link> links, Index unknowns, MatrixXd begin, Index shared, const MatrixXd& last_rows)
    : unknowns_(unknowns), shared_(shared), begin_(std::move(begin)), steps_(links.size()) {
  const Index last = begin_.cols();
  MatrixXd left(0, shared);  // of later links, over [state | shared]
  for (std::size_t p = links.size(); p-- > 0;) {
    Link& link = links[p];
    Step& step = steps_[p];
    const Index state = link.rows.cols() - link.own - shared;
    step.first = link.first, step.own = link.own, step.state = state;
    step.transition = std::move(link.transition);
    MatrixXd rows = below(link.rows, through(left, shared, step.transition, link.own + state));
    link.rows.resize(0, 0);
    left = rows.rightCols(state + shared);
    if (step.own > 0) {
      step.eliminate.emplace(rows.leftCols(step.own));
      left = step.eliminate->rotated(left);
      step.beyond = left.topRows(step.eliminate->rank());
      left = left.bottomRows(left.rows() - step.eliminate->rank()).eval();
    }
    if (p == 0 || left.rows() <= left.cols() || left.cols() == 0) continue;
    step.rest.emplace(std::move(left));
    left = step.rest->triangle();
  }
  MatrixXd of_last = MatrixXd::Zero(left.rows() + last_rows.rows(), last);
  if (!steps_.empty()) {
    if (begin_.rows() > 0) of_last.topRows(left.rows()) = left.leftCols(begin_.rows()) * begin_;
    of_last.topRows(left.rows()).rightCols(shared) += left.rightCols(shared);
  }
  of_last.bottomRows(last_rows.rows()) = last_rows;
  last_.emplace(of_last);
}

ChainEliminator::Rotated ChainEliminator::rotated(std::vector<MatrixXd> right, const MatrixXd& last_right) const {
  Rotated result;
  result.own.resize(steps_.size());
  MatrixXd left(0, last_right.cols());
  const auto put_beside = [&](MatrixXd rows) {
    if (rows.rows() > 0) result.beside.push_back(rows.rows() > rows.cols() ? compress(std::move(rows)) : std::move(rows));
  };
  for (std::size_t p = steps_.size(); p-- > 0;) {
    const Step& step = steps_[p];
    left = below(right[p], left);
    if (step.own > 0) {
      left = step.eliminate->rotated(left);
      result.own[p] = left.topRows(step.eliminate->rank());
      left = left.bottomRows(left.rows() - step.eliminate->rank()).eval();
    }
    if (!step.rest) continue;
    left = step.rest->rotated(std::move(left));
    put_beside(left.bottomRows(left.rows() - step.rest->cols()));
    left = left.topRows(step.rest->cols()).eval();
  }
  left = last_->rotated(below(left, last_right));
  result.last = left.topRows(last_->rank());
  put_beside(left.bottomRows(left.rows() - last_->rank()));
  return result;
}

/// The unknowns from the last ones and the coordinates of each link's own, in the order of time.
MatrixXd ChainEliminator::solved(const MatrixXd& last, const std::vector<MatrixXd>& own) const {
  MatrixXd all = MatrixXd::Zero(unknowns_, last.cols());
  all.bottomRows(last.rows()) = last;
  MatrixXd state = begin_ * last;
  for (std::size_t p = 0; p < steps_.size(); ++p) {
    const Step& step = steps_[p];
    MatrixXd next(step.own + step.state, last.cols());
    next.bottomRows(step.state) = state;
    if (step.own > 0) {
      MatrixXd right = own.empty() ? MatrixXd(MatrixXd::Zero(step.beyond.rows(), last.cols())) : own[p];
      right -= product(step.beyond.leftCols(step.state), state) + step.beyond.rightCols(shared_) * last.bottomRows(shared_);
      next.topRows(step.own) = step.eliminate->solve(right);
      all.middleRows(step.first, step.own) = next.topRows(step.own);
    }
    if (step.transition.size() > 0) state = product(step.transition, next);
  }
  return all;
}

MatrixXd ChainEliminator::solve(const Rotated& rotated) const { return solved(last_->solve(rotated.last), rotated.own); }

VectorXd ChainEliminator::covariance_column(Index j) const {
  const Index before = unknowns_ - begin_.cols();
  return solved(last_->covariance_column(j - before), {});
}

void ChainEliminator::for_each_row(const std::function<void(const MatrixXd& rows)>& take) const {
  MatrixXd state = MatrixXd::Zero(begin_.rows(), unknowns_);
  state.rightCols(begin_.cols()) = begin_;
  for (const Step& step : steps_) {
    if (step.own > 0) {
      MatrixXd rows = product(step.beyond.leftCols(step.state), state);
      rows.middleCols(step.first, step.own) += step.eliminate->coordinates();
      rows.rightCols(shared_) += step.beyond.rightCols(shared_);
      take(rows);
    }
    if (step.transition.size() == 0) continue;
    MatrixXd next = product(step.transition.rightCols(step.state), state);
    next.middleCols(step.first, step.own) += step.transition.leftCols(step.own);
    state = std::move(next);
  }
  MatrixXd of_last = MatrixXd::Zero(begin_.cols(), unknowns_);
  of_last.rightCols(begin_.cols()) = last_->factor();
  take(of_last);
}

MatrixXd ChainEliminator::factor() const {
  if (steps_.empty()) return last_->factor();
  std::vector<MatrixXd> rows;
  for_each_row([&](const MatrixXd& some) { rows.push_back(some); });
  MatrixXd triangle = MatrixXd::Zero(unknowns_, unknowns_);
  const MatrixXd found = compress(stacked(rows, unknowns_));
  triangle.topRows(found.rows()) = found;
  return triangle;
}

ChainEliminator::Held ChainEliminator::held(const VectorXd& at, const std::vector<MatrixXd>& further, const MatrixXd& last) const {
  std::vector<Link> links(steps_.size());
  std::vector<MatrixXd> right(steps_.size());
  const Index count = begin_.cols();
  VectorXd state = begin_ * at.tail(count);
  for (std::size_t p = 0; p < steps_.size(); ++p) {
    const Step& step = steps_[p];
    const Index reached = step.beyond.rows();
    MatrixXd rows = MatrixXd::Zero(reached + further[p].rows(), step.own + step.state + shared_);
    VectorXd there(rows.cols());
    there << at.segment(step.first, step.own), state, at.tail(shared_);
    if (step.own > 0) rows.topRows(reached) << step.eliminate->coordinates(), step.beyond;
    rows.bottomRows(further[p].rows()) = further[p];
    right[p] = MatrixXd::Zero(rows.rows(), 1);
    right[p].topRows(reached) = rows.topRows(reached) * there;
    if (step.transition.size() > 0) state = step.transition * there.head(step.own + step.state);
    links[p] = {step.first, step.own, std::move(rows), step.transition};
  }
  MatrixXd last_rows(count + last.rows(), count), last_right = MatrixXd::Zero(last_rows.rows(), 1);
  last_rows << last_->factor(), last;
  last_right.topRows(count) = last_rows.topRows(count) * at.tail(count);
  ChainEliminator chain(std::move(links), unknowns_, begin_, shared_, last_rows);
  VectorXd unknowns = chain.solve(chain.rotated(std::move(right), last_right));
  return {std::move(chain), std::move(unknowns)};
}

VectorXd ChainEliminator::damped_step(const VectorXd& full, double damping) const {
  VectorXd squares = VectorXd::Zero(unknowns_);
  for_each_row([&](const MatrixXd& rows) { squares += rows.colwise().squaredNorm().transpose(); });
  const VectorXd damped = (damping * squares).cwiseSqrt();
  std::vector<MatrixXd> further;
  for (const Step& step : steps_) {
    further.emplace_back(MatrixXd::Zero(step.own, step.own + step.state + shared_));
    further.back().leftCols(step.own) = damped.segment(step.first, step.own).asDiagonal();
  }
  return held(full, further, MatrixXd(damped.tail(begin_.cols()).asDiagonal())).unknowns;
}

std::vector<MatrixXd> ChainEliminator::covariance_roots() const {
  const auto inverse = [](const Eliminator& eliminate) { return eliminate.solve(MatrixXd::Identity(eliminate.rank(), eliminate.rank())); };
  std::vector<MatrixXd> roots;
  const MatrixXd last = inverse(*last_);
  MatrixXd root(begin_.rows() + shared_, last.cols());  // of [state | shared]
  root << begin_ * last, last.bottomRows(shared_);
  for (const Step& step : steps_) {
    const Index fresh = step.own > 0 ? step.eliminate->rank() : 0;
    MatrixXd joint = MatrixXd::Zero(step.own + root.rows(), root.cols() + fresh);  // of [own | state | shared]
    joint.bottomLeftCorner(root.rows(), root.cols()) = root;
    if (step.own > 0) {
      joint.topLeftCorner(step.own, root.cols()) = -step.eliminate->solve(product(step.beyond, root));
      joint.topRightCorner(step.own, fresh) = inverse(*step.eliminate);
    }
    roots.push_back(joint.topRows(step.own + step.state));
    if (step.transition.size() == 0) continue;
    MatrixXd next(step.transition.rows() + shared_, joint.cols());
    next << product(step.transition, roots.back()), joint.bottomRows(shared_);
    root = compress(next.transpose()).transpose();
  }
  roots.push_back(last);
  return roots;
}

}  // namespace unrig::run_rows
