#include "core/numerics/prior_cost.h"

#include <Eigen/SVD>

namespace unrig {

double prior_cost(const Eigen::MatrixXd& triangle, const Eigen::VectorXd& estimate, const Eigen::MatrixXd& likely) {
  const Eigen::JacobiSVD<Eigen::MatrixXd> told(triangle * likely, Eigen::ComputeThinU);
  const Eigen::ArrayXd square = told.singularValues().array().square(), taken = (told.matrixU().transpose() * (triangle * estimate)).array().square();
  return square.log1p().sum() + (taken / (1 + square)).sum();
}

}  // namespace unrig
