#include "correct/estimate/constrained_step.h"

#include <gtest/gtest.h>

#include <random>
#include <stdexcept>
#include <vector>

#include "core/model/wagner.h"
#include "correct/correct.h"
#include "tests/correct/null_campaign.h"

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

MatrixXd random_matrix(Index rows, Index cols, std::mt19937_64& random) {
  std::normal_distribution<double> normal;
  return MatrixXd::NullaryExpr(rows, cols, [&] { return normal(random); });
}

TEST(ConstrainedStep, SatisfiesTheConditionsOfTheLeast) {
  // Kuhn and Tucker: feasible; the gradient of the squares is a combination of the bounds' rows that are met, with factors of one sign.
  std::mt19937_64 random(3);
  Index met = 0;
  for (int trial = 0; trial < 40; ++trial) {
    const Index n = 1 + trial % 7, bounds = 1 + trial % 11;
    const MatrixXd rows = random_matrix(n + 5, n, random), above = random_matrix(bounds, n, random);
    const VectorXd right = random_matrix(n + 5, 1, random), inside = random_matrix(n, 1, random), least = above * inside - random_matrix(bounds, 1, random).cwiseAbs();
    const VectorXd x = least_squares_above(rows, right, above, least), slack = above * x - least;
    EXPECT_GT(slack.minCoeff(), -1e-9) << trial;
    std::vector<Index> touched;
    for (Index i = 0; i < bounds; ++i)
      if (slack[i] < 1e-8) touched.push_back(i);
    const VectorXd gradient = rows.transpose() * (rows * x - right);
    met += static_cast<Index>(touched.size());
    if (touched.empty()) {
      EXPECT_LT(gradient.norm(), 1e-8) << trial;
      continue;
    }
    const MatrixXd walls = above(touched, Eigen::all).transpose();
    EXPECT_LT((walls * non_negative_least_squares(walls, gradient) - gradient).norm(), 1e-8 * (1 + gradient.norm())) << trial;
  }
  EXPECT_GT(met, 20) << "bounds that matter";
}

TEST(ConstrainedStep, BoundsThatContradictEachOtherAreRefused) {
  const MatrixXd above = (MatrixXd(2, 1) << 1, -1).finished();
  EXPECT_THROW(least_squares_above(MatrixXd::Ones(3, 1), VectorXd::Zero(3), above, Eigen::Vector2d(1, 0)), std::invalid_argument);
}

/// step_a with so much noise in the gauge (3 N, a hundred times its own) that the free response falls somewhere.
CorrectProblem noisy_problem() {
  CorrectProblem problem = test::null_problem("step_a");
  std::mt19937_64 random(4);
  std::normal_distribution<double> normal;
  for (Channel& channel : problem.run.channels)
    if (channel.name == "gauge")
      for (double& x : channel.value) x += 3 * normal(random);
  return problem;
}

double steepest_fall(const VectorXd& phi) { return (phi.tail(phi.size() - 1) - phi.head(phi.size() - 1)).minCoeff(); }

TEST(Imposed, MonotoneResponseNeverFallsAndIsNoWorse) {
  CorrectProblem problem = noisy_problem();
  const CorrectResult free = correct(problem);
  ASSERT_LT(steepest_fall(free.indicial.value), -1e-4) << "there is something to impose";
  problem.imposed.monotone = true;
  const CorrectResult monotone = correct(problem);
  EXPECT_GT(steepest_fall(monotone.indicial.value), -1e-8);
  EXPECT_GT(steepest_fall(monotone.indicial.half_weight), -1e-8);
  EXPECT_GT(steepest_fall(monotone.indicial.twice_weight), -1e-8);
  EXPECT_LE(monotone.indicial.value.maxCoeff(), 1 + 1e-8) << "its limit";
  // What the free estimate says of it stays on record; Wagner's function, which never falls, is inside both bands.
  EXPECT_EQ(monotone.indicial.steepest_fall, free.indicial.steepest_fall);
  EXPECT_EQ(monotone.indicial.monotone_p, free.indicial.monotone_p);
  EXPECT_GT(monotone.reduced_chi2, free.reduced_chi2);
  EXPECT_LT(monotone.reduced_chi2, 1.01 * free.reduced_chi2);
  for (Index i = 0; i < monotone.indicial.value.size(); ++i)
    EXPECT_NEAR(monotone.indicial.value[i], wagner_exact(monotone.indicial.semichords[i]), monotone.indicial.uncertainty.simultaneous * monotone.indicial.uncertainty.std[i]) << i;
}

TEST(Imposed, WhereNothingFallsMonotonicityChangesNothing) {
  CorrectProblem problem = test::null_problem("step_a");
  const CorrectResult free = correct(problem);
  problem.imposed.monotone = true;
  const CorrectResult monotone = correct(problem);
  // Both end where a step promises less than a thousandth of chi-square, so that they differ by a few hundredths of a standard deviation at most.
  for (Index i = 0; i < free.indicial.value.size(); ++i) EXPECT_NEAR(monotone.indicial.value[i], free.indicial.value[i], 0.05 * free.indicial.uncertainty.std[i]);
}

TEST(Imposed, StartOfTheResponseIsWhatWasAskedFor) {
  CorrectProblem problem = test::null_problem("step_a");
  const CorrectResult free = correct(problem);
  problem.imposed.at_step = 0.5;
  const CorrectResult half = correct(problem);
  EXPECT_NEAR(half.indicial.value[0] - (wagner_exact(0.01) - 0.5), 0.5, 1e-3) << "0.01 semichords after it";
  EXPECT_EQ(half.indicial.at_step, free.indicial.at_step);
  EXPECT_LT(half.slope_std, 0.7 * free.slope_std) << "true knowledge narrows the band";
  EXPECT_NEAR(half.slope, 5.8636, 3 * half.slope_std);  // KEY.json

  problem.imposed = {true, 1.2};
  EXPECT_THROW(correct(problem), InputError);
}

}  // namespace
}  // namespace unrig
