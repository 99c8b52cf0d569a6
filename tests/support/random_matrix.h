#pragma once
#include <Eigen/Core>
#include <random>

namespace unrig::test {

/// Independent standard normal numbers.
inline Eigen::MatrixXd random_matrix(Eigen::Index rows, Eigen::Index cols, unsigned seed) {
  std::mt19937_64 engine(seed);
  std::normal_distribution<double> normal;
  return Eigen::MatrixXd::NullaryExpr(rows, cols, [&] { return normal(engine); });
}

}  // namespace unrig::test
