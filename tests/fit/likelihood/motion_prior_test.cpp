// How rough a motion may be, learned from motions whose roughness is known.

#include "fit/likelihood/motion_prior.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "tests/fit/run_cases.h"

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using run_cases::Case;

/// A run whose shaft moves in two windows by splines with these coefficients, `factor` times all of it: motion, loads and noise.
Case shaken(const std::vector<MotionBasis::Window>& windows, const VectorXd& u, double factor) {
  Case c{"shaken", run_cases::beam_model(), run_cases::empty_run(RunKind::step, 0.6, run_cases::dt), windows, {}};
  const VectorXd motion = MotionBasis(run_cases::samples, windows).coefficients(u);
  constexpr double angle_noise = 1e-5;  // far below what the motion does from knot to knot: then its differences are known
  run_cases::add_channel(c.run, "alpha", factor * ((motion_of(motion, run_cases::dt).angle + run_cases::white_noise(run_cases::samples, angle_noise, 7)).array() + 0.04).matrix(), "rad");
  c.theta = c.model->start_values();
  run_cases::simulate(c, c.theta, {"gauge"}, factor * motion);
  return c;
}

const std::vector<MotionBasis::Window> windows{{{40, 80}, 1}, {{140, 190}, 1}};

/// Coefficients that are independent of each other, so that fourth differences have 70 times their variance (1, -4, 6, -4, 1).
VectorXd rough(double deviation) { return run_cases::white_noise(MotionBasis(run_cases::samples, windows).unknowns(), deviation, 3); }

TEST(MotionPrior, HasNothingToSayOfADecay) {
  const Case c = run_cases::pluck({"gauge"});
  EXPECT_EQ(motion_prior(c.residual(), c.theta).size(), 0);
}

/// Of differences that the data determine, the scales are their own size: the rows leave them about one each. Less, because each group is as wide as the wider of its neighbours, and scatter by how few there
/// are in a group: five, which tell their variance to 60 %.
TEST(MotionPrior, ScalesDifferencesToTheirOwnSize) {
  for (const double deviation : {1e-3, 1e-2}) {
    const VectorXd u = rough(deviation);
    const Case c = shaken(windows, u, 1);
    const MatrixXd rows = motion_prior(c.residual(), c.theta);
    ASSERT_EQ(rows.cols(), c.residual().linear_unknowns());
    EXPECT_EQ(rows.rightCols(2).norm(), 0) << "it knows nothing of offset and angle before the motion";
    const VectorXd left = rows.leftCols(u.size()) * u;
    const double mean = left.squaredNorm() / static_cast<double>(left.size());
    EXPECT_LT(mean, 1.1) << deviation;
    EXPECT_GT(mean, 0.3) << deviation;
  }
}

TEST(MotionPrior, GoesWithTheUnitOfTheAngle) {
  const VectorXd u = rough(2e-3);
  const Case one = shaken(windows, u, 1), three = shaken(windows, u, 3);
  const MatrixXd rows = motion_prior(one.residual(), one.theta), of_three = motion_prior(three.residual(), three.theta);
  ASSERT_EQ(rows.rows(), of_three.rows());
  EXPECT_LT((rows - 3 * of_three).norm(), 0.05 * rows.norm());  // its search ends when scales change by 2 %
}

/// Where a record breaks off in a rough motion nothing says that it is smooth behind that: its scales go on from those before.
TEST(MotionPrior, GoesOnBehindTheLastReading) {
  const std::vector<MotionBasis::Window> one{{{40, 180}, 1}};
  const Case c = shaken(one, run_cases::white_noise(141, 2e-3, 3), 1);
  const VectorXd size = motion_prior(c.residual({25}), c.theta).rowwise().norm();
  const double largest = size.maxCoeff();
  EXPECT_LT(largest, 30 * size.head(20).maxCoeff()) << "scales of neighbours differ by factors of two or three; at their floor the rows are 70 000 times as large";
}

/// A window that is rough does not make another one rough.
TEST(MotionPrior, EachWindowHasItsOwnRoughness) {
  const Index first = windows.front().knots.length();
  VectorXd u = rough(2e-3);
  const double both = motion_prior(shaken(windows, u, 1).residual(), run_cases::beam_model()->start_values()).leftCols(first - 8).norm();
  u.tail(u.size() - first - 1) *= 10;
  const Case c = shaken(windows, u, 1);
  const MatrixXd rows = motion_prior(c.residual(), c.theta);
  EXPECT_NEAR(rows.leftCols(first - 8).norm(), both, 0.1 * both);
  const VectorXd left = rows.leftCols(u.size()) * u;
  EXPECT_LT(left.squaredNorm() / static_cast<double>(left.size()), 1.1);
}

}  // namespace
}  // namespace unrig
