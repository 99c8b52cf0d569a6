#include "core/numerics/prior_cost.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "tests/support/random_matrix.h"

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using test::random_matrix;

/// The evidence of data y = A x + noise by the covariance of y, without x.
TEST(PriorCost, WithTheFreeFitIsTheEvidenceOfTheData) {
  for (const double known : {1e-3, 1.0, 1e3}) {
    constexpr Index rows = 7, unknowns = 3;
    const MatrixXd A = known * random_matrix(rows, unknowns, 1), L = random_matrix(unknowns, unknowns, 2);
    const VectorXd y = known * random_matrix(rows, 1, 3) + random_matrix(rows, 1, 4);
    const MatrixXd covariance = MatrixXd::Identity(rows, rows) + A * L * L.transpose() * A.transpose();
    const double evidence = std::log(covariance.determinant()) + y.dot(covariance.partialPivLu().solve(y));
    const MatrixXd R = (A.transpose() * A).llt().matrixU();
    const VectorXd estimate = (A.transpose() * A).partialPivLu().solve(A.transpose() * y);
    EXPECT_NEAR((y - A * estimate).squaredNorm() + prior_cost(R, estimate, L), evidence, 1e-8 * std::max(1.0, evidence)) << known;  // of 16 digits the condition of the covariance, some 1e7, takes as many
  }
}

/// Of what the data do not know at all a free fit takes a square of the noise for each unknown, which is no evidence.
TEST(PriorCost, GivesBackWhatAFreeFitTookOfTheNoise) {
  constexpr double hardly = 1e-6;
  const VectorXd noise = random_matrix(4, 1, 5);
  EXPECT_NEAR(prior_cost(hardly * MatrixXd::Identity(4, 4), noise / hardly, MatrixXd::Identity(4, 4)), noise.squaredNorm(), 1e-9);
}

}  // namespace
}  // namespace unrig
