#include "fit/motion_prior.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <vector>

#include "fit/run_linearised.h"

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
  MatrixXd c = MatrixXd::Zero(last - first, motion.unknowns());
  for (Index j = 0; j < motion.unknowns(); ++j) {
    const MotionBasis::Column& column = motion.columns()[static_cast<std::size_t>(j)];
    for (Index k = std::max(first, column.first); k < last; ++k) c(k - first, j) = k - column.first < column.value.size() ? column.value[k - column.first] : column.tail;
  }
  for (int k = 0; k < order; ++k) {
    const Index left = c.rows() - s;
    c = (c.bottomRows(left) - c.topRows(left)).eval();
  }
  return c;
}

/// Neighbouring differences that share a scale: rows over the few unknowns that they touch, from `first` on.
struct Group {
  MatrixXd rows;
  Index first, window;
};

/// Empty where nothing moves.
Group touched(const MatrixXd& rows, Index window) {
  Index first = 0, last = rows.cols();
  while (first < last && rows.col(first).isZero(0)) ++first;
  while (last > first && rows.col(last - 1).isZero(0)) --last;
  return {rows.middleCols(first, last - first), first, window};
}

/// Each group at least as wide as the wider of its neighbours in the same window: where a motion turns from rough to smooth, the few differences of a group that
/// happen to be small would pass for smooth ones, and the band of the load would be too narrow there.
std::vector<double> as_wide_as_neighbours(const std::vector<double>& precision, const std::vector<Group>& groups) {
  std::vector<double> widest = precision;
  for (std::size_t g = 1; g < precision.size(); ++g) {
    if (groups[g].window != groups[g - 1].window) continue;
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
  std::vector<Group> groups;
  for (const MotionBasis::Window& window : motion.windows()) {
    const MatrixXd d = differences(motion, window);
    const Index size = group_size * window.stride;
    for (Index first = 0; first < d.rows(); first += size) {
      Group group = touched(d.middleRows(first, std::min(size, d.rows() - first)), window.knots.first);
      if (group.rows.cols() > 0) groups.push_back(std::move(group));
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
    for (std::size_t g = 0; g < groups.size(); ++g) {
      const Index width = groups[g].rows.cols();
      posterior.block(groups[g].first, groups[g].first, width, width).noalias() += precision[g] * groups[g].rows.transpose() * groups[g].rows;
    }
    const Eigen::LLT<MatrixXd> llt(scale.asDiagonal() * posterior * scale.asDiagonal());
    const VectorXd c = scale.cwiseProduct(llt.solve(scale.cwiseProduct(right)));
    const MatrixXd root = llt.matrixL().solve(MatrixXd(scale.asDiagonal()));  // root^T root = posterior^-1
    double change = 0;
    for (std::size_t g = 0; g < groups.size(); ++g) {
      const auto& [rows, first, window] = groups[g];
      const double left_open = (root.middleCols(first, rows.cols()) * rows.transpose()).squaredNorm();
      const double determined = std::max(1e-3, static_cast<double>(rows.rows()) - precision[g] * left_open);
      // A group of smooth motion would let its scale run to zero; a thousandth of the angle's noise is smooth enough.
      const double floor = 1e-6 * residual.angle_sigma() * residual.angle_sigma();
      const double variance = std::max(floor, (rows * c.segment(first, rows.cols())).squaredNorm() / determined);
      change = std::max(change, std::abs(std::log(variance * precision[g])));
      precision[g] = 1 / variance;
    }
    if (change < 0.02) break;
  }

  precision = as_wide_as_neighbours(precision, groups);

  Index count = 0;
  for (Group& group : groups) {
    group.rows = run_rows::compress(std::move(group.rows));
    count += group.rows.rows();
  }
  MatrixXd prior = MatrixXd::Zero(count, unknowns);
  Index row = 0;
  for (std::size_t g = 0; g < groups.size(); ++g) {
    prior.block(row, groups[g].first, groups[g].rows.rows(), groups[g].rows.cols()) = std::sqrt(precision[g]) * groups[g].rows;
    row += groups[g].rows.rows();
  }
  return prior;
}

}  // namespace unrig
