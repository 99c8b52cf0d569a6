#include "fit/likelihood/eliminator.h"

#include <cmath>
#include <utility>

namespace unrig::run_rows {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

MatrixXd compress(MatrixXd rows) { return Householder(std::move(rows)).triangle(); }

MatrixXd stacked(const std::vector<MatrixXd>& blocks, Index columns) {
  Index total = 0;
  for (const MatrixXd& block : blocks) total += block.rows();
  MatrixXd stack(total, columns);
  Index row = 0;
  for (const MatrixXd& block : blocks) {
    stack.middleRows(row, block.rows()) = block;
    row += block.rows();
  }
  return stack;
}

Eliminator::Eliminator(const MatrixXd& columns) : scale_(columns.colwise().norm().transpose().cwiseMax(1e-300).cwiseInverse()) {
  constexpr double rank_tolerance = 1e-11;
  const MatrixXd scaled = columns * scale_.asDiagonal();
  quick_ = Householder(scaled);
  if (columns.rows() >= columns.cols() && (columns.cols() == 0 || quick_.factors().diagonal().cwiseAbs().minCoeff() > rank_tolerance)) return;
  pivoted_.setThreshold(rank_tolerance);
  pivoted_.compute(scaled);
  deficient_ = true;
}

MatrixXd Eliminator::rotated(const MatrixXd& rows) const {
  return deficient_ ? MatrixXd(pivoted_.householderQ().setLength(pivoted_.rank()).adjoint() * rows) : quick_.rotated(rows);
}

MatrixXd Eliminator::solve(const MatrixXd& rotated) const {
  const Index r = rank();
  MatrixXd x = MatrixXd::Zero(scale_.size(), rotated.cols());
  if (deficient_) {
    x.topRows(r) = pivoted_.matrixQR().topLeftCorner(r, r).triangularView<Eigen::Upper>().solve(rotated.topRows(r));
    x = pivoted_.colsPermutation() * x;
  } else {
    x = quick_.factors().topLeftCorner(r, r).triangularView<Eigen::Upper>().solve(rotated.topRows(r));
  }
  return scale_.asDiagonal() * x;
}

VectorXd Eliminator::covariance_column(Index j) const {
  const Index r = rank();
  VectorXd score = scale_[j] * VectorXd::Unit(scale_.size(), j);
  if (deficient_) score = pivoted_.colsPermutation().transpose() * score;
  const auto& factors = deficient_ ? pivoted_.matrixQR() : quick_.factors();
  return solve(factors.topLeftCorner(r, r).triangularView<Eigen::Upper>().transpose().solve(score.head(r)));
}

MatrixXd Eliminator::coordinates() const {
  const Index r = rank();
  MatrixXd rows = (deficient_ ? pivoted_.matrixQR() : quick_.factors()).topRows(r).triangularView<Eigen::Upper>();
  if (deficient_) rows = rows * pivoted_.colsPermutation().transpose();
  return rows * scale_.cwiseInverse().asDiagonal();
}

MatrixXd Eliminator::factor() const {
  if (!deficient_) return coordinates();
  MatrixXd r = MatrixXd::Zero(scale_.size(), scale_.size());
  r.topRows(rank()) = compress(coordinates());
  return r;
}

}  // namespace unrig::run_rows
