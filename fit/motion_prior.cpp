#include "fit/motion_prior.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <vector>

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr int order = 4;
constexpr Index group_size = 5;

/// Fourth differences of the fine coefficients over everything a window touches, one row each, over the motion unknowns.
MatrixXd differences(const MotionBasis& motion, const MotionBasis::Window& window) {
  const Index s = window.stride, first = std::max<Index>(0, window.knots.first - order * s), last = std::min(motion.samples(), window.knots.last + (order + 4) * s);
  MatrixXd c(last - first, motion.unknowns());
  for (Index j = 0; j < motion.unknowns(); ++j) c.col(j) = motion.coefficients(VectorXd::Unit(motion.unknowns(), j)).segment(first, last - first);
  for (int k = 0; k < order; ++k) {
    const Index left = c.rows() - s;
    c = (c.bottomRows(left) - c.topRows(left)).eval();
  }
  return c;
}

/// Each group at least as wide as the wider of its neighbours in the same window: where a motion turns from rough to smooth, the few differences of a group that
/// happen to be small would pass for smooth ones, and the band of the load would be too narrow there.
std::vector<double> as_wide_as_neighbours(const std::vector<double>& precision, const std::vector<Index>& window) {
  std::vector<double> widest = precision;
  for (std::size_t g = 1; g < precision.size(); ++g) {
    if (window[g] != window[g - 1]) continue;
    widest[g] = std::min(widest[g], precision[g - 1]);
    widest[g - 1] = std::min(widest[g - 1], precision[g]);
  }
  return widest;
}

}  // namespace

MatrixXd motion_prior(const RunResidual& residual, const VectorXd& theta) {
  const MotionBasis& motion = residual.motion();
  if (motion.unknowns() == 0) return {};
  const Index unknowns = residual.linear_unknowns();
  std::vector<MatrixXd> groups;
  std::vector<Index> of_window;
  for (const MotionBasis::Window& window : motion.windows()) {
    const MatrixXd d = differences(motion, window);
    const Index size = group_size * window.stride;
    for (Index first = 0; first < d.rows(); first += size) {
      MatrixXd group = MatrixXd::Zero(std::min(size, d.rows() - first), unknowns);
      group.leftCols(motion.unknowns()) = d.middleRows(first, group.rows());
      if (group.norm() > 0) groups.push_back(std::move(group)), of_window.push_back(window.knots.first);
    }
  }

  const MatrixXd triangle = residual.linear_rows(theta);  // [R | q]
  const MatrixXd R = triangle.topLeftCorner(unknowns, unknowns);
  const MatrixXd information = R.transpose() * R;
  const VectorXd right = R.transpose() * triangle.col(unknowns).head(unknowns);
  const VectorXd scale = information.diagonal().cwiseSqrt().cwiseMax(1e-300).cwiseInverse();

  // Scales from very wide downwards; each round is one pass of MacKay's fixed point.
  std::vector<double> precision(groups.size());
  const double wide = 1e3 * residual.angle_sigma();
  std::fill(precision.begin(), precision.end(), 1 / (wide * wide));
  constexpr int rounds = 40;
  for (int round = 0; round < rounds; ++round) {
    MatrixXd posterior = information;
    for (std::size_t g = 0; g < groups.size(); ++g) posterior.noalias() += precision[g] * groups[g].transpose() * groups[g];
    const Eigen::LLT<MatrixXd> llt(scale.asDiagonal() * posterior * scale.asDiagonal());
    const VectorXd c = scale.cwiseProduct(llt.solve(scale.cwiseProduct(right)));
    double change = 0;
    for (std::size_t g = 0; g < groups.size(); ++g) {
      const MatrixXd half = llt.matrixL().solve(scale.asDiagonal() * groups[g].transpose());
      const double determined = std::max(1e-3, static_cast<double>(groups[g].rows()) - precision[g] * half.squaredNorm());
      // A group of smooth motion would let its scale run to zero; a thousandth of the angle's noise is smooth enough.
      const double floor = 1e-6 * residual.angle_sigma() * residual.angle_sigma();
      const double variance = std::max(floor, (groups[g] * c).squaredNorm() / determined);
      change = std::max(change, std::abs(std::log(variance * precision[g])));
      precision[g] = 1 / variance;
    }
    if (change < 0.02) break;
  }

  precision = as_wide_as_neighbours(precision, of_window);

  Index rows = 0;
  for (const MatrixXd& group : groups) rows += group.rows();
  MatrixXd prior(rows, unknowns);
  Index row = 0;
  for (std::size_t g = 0; g < groups.size(); ++g) {
    prior.middleRows(row, groups[g].rows()) = std::sqrt(precision[g]) * groups[g];
    row += groups[g].rows();
  }
  return prior;
}

}  // namespace unrig
