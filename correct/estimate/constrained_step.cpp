#include "correct/estimate/constrained_step.h"

#include <Eigen/QR>
#include <stdexcept>
#include <vector>

namespace unrig {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

VectorXd non_negative_least_squares(const MatrixXd& a, const VectorXd& b) {
  const Index n = a.cols();
  const double tolerance = 1e-13 * a.cwiseAbs().maxCoeff() * (b.norm() + 1e-300);
  VectorXd x = VectorXd::Zero(n);
  std::vector<bool> free(static_cast<std::size_t>(n), false);
  for (Index round = 0; round < 3 * n; ++round) {
    const VectorXd gain = a.transpose() * (b - a * x);
    Index next = -1;
    for (Index j = 0; j < n; ++j)
      if (!free[static_cast<std::size_t>(j)] && gain[j] > tolerance && (next < 0 || gain[j] > gain[next])) next = j;
    if (next < 0) break;
    free[static_cast<std::size_t>(next)] = true;
    for (;;) {
      std::vector<Index> set;
      for (Index j = 0; j < n; ++j)
        if (free[static_cast<std::size_t>(j)]) set.push_back(j);
      const VectorXd best = MatrixXd(a(Eigen::all, set)).colPivHouseholderQr().solve(b);
      // Towards the best until the first variable reaches its bound.
      double share = 1;
      Index stopped = -1;
      for (std::size_t i = 0; i < set.size(); ++i)
        if (const auto k = static_cast<Index>(i); best[k] <= 0 && x[set[i]] / (x[set[i]] - best[k]) < share) share = x[set[i]] / (x[set[i]] - best[k]), stopped = set[i];
      for (std::size_t i = 0; i < set.size(); ++i) x[set[i]] += share * (best[static_cast<Index>(i)] - x[set[i]]);
      if (stopped < 0) break;
      x[stopped] = 0;
      for (const Index j : set)
        if (x[j] <= 0) x[j] = 0, free[static_cast<std::size_t>(j)] = false;
    }
  }
  return x;
}

VectorXd least_squares_above(const MatrixXd& rows, const VectorXd& right, const MatrixXd& above, const VectorXd& least) {
  const VectorXd scale = rows.colwise().norm().transpose().cwiseMax(1e-300).cwiseInverse();
  const Eigen::ColPivHouseholderQR<MatrixXd> qr(rows * scale.asDiagonal());
  const VectorXd free = scale.cwiseProduct(qr.solve(right));
  // x = free + scale P R^-1 y, |rows x - right|^2 = |y|^2 + constant; above scale P R^-1 y >= least - above free.
  const Index n = rows.cols();
  const auto R = qr.matrixR().topRows(n).triangularView<Eigen::Upper>();
  const MatrixXd back = scale.asDiagonal() * (qr.colsPermutation() * MatrixXd(R.solve(MatrixXd::Identity(n, n))));
  MatrixXd bounds = above * back;
  VectorXd wanted = least - above * free;
  for (Index i = 0; i < bounds.rows(); ++i)
    if (const double size = bounds.row(i).norm(); size > 0) bounds.row(i) /= size, wanted[i] /= size;
  const double unit = wanted.maxCoeff();
  if (unit <= 0) return free;
  wanted /= unit;
  MatrixXd dual(n + 1, bounds.rows());
  dual << bounds.transpose(), wanted.transpose();
  const VectorXd u = non_negative_least_squares(dual, VectorXd::Unit(n + 1, n)), left = dual * u - VectorXd::Unit(n + 1, n);
  constexpr double nothing_left = 1e-9;
  if (left.norm() < nothing_left) throw std::invalid_argument("no solution satisfies the inequalities");
  return free + back * VectorXd(left.head(n) * (-unit / left[n]));
}

}  // namespace unrig
