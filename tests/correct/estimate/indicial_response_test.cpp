// The response with what is uncertain about it, for parameters whose covariance is given.

#include "correct/estimate/indicial_response.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <cmath>
#include <numbers>
#include <random>

#include "tests/support/sample_data.h"

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

AeroelasticModel free_model(const VectorXd& rates) {
  const Rig rig = read_rig(test::null_campaign("rig.toml"));
  return {rig, make_basis(rig, Index{1}, Index{1}), {"free", VectorXd::Constant(rates.size(), 0.2), rates}, AeroelasticModel::Circulation::free};
}

/// A budget under which theta has this covariance, all of it from the gauge, and one linear unknown has nothing to do with it.
UncertaintyBudget budget_of(const MatrixXd& covariance) {
  const Index parameters = covariance.rows();
  RunResidual::Evaluation e;
  e.jacobian = MatrixXd(covariance.inverse()).llt().matrixU();
  e.linear = VectorXd::Zero(1);
  e.linear_slope = MatrixXd::Zero(1, parameters);
  e.linear_factor = MatrixXd::Ones(1, 1);
  Prior prior;
  for (Index j = 0; j < parameters; ++j) prior.free.push_back(j);
  prior.known = MatrixXd::Zero(0, parameters);
  prior.share = VectorXd::Zero(0);
  const auto nothing = [](const MatrixXd& F, const MatrixXd&) -> UncertaintyBudget::Shares { return {MatrixXd::Zero(F.cols(), F.cols()), MatrixXd::Zero(F.cols(), F.cols())}; };
  return {e, prior, nothing, [](const MatrixXd& F, const MatrixXd&) -> VectorXd { return VectorXd::Zero(F.rows()); }, 0, 1};
}

/// phi, and the coefficient per radian, straight from their formulas.
double response(const AeroelasticModel& model, const VectorXd& theta, double s) {
  double phi = 1;
  for (Index k = 0; k < model.circulation().rate.size(); ++k) phi -= theta[model.circulation_parameter(k)] * std::exp(-model.circulation().rate[k] * s);
  return phi;
}
double per_radian(const AeroelasticModel& model, const VectorXd& theta, double s) { return theta[model.index("normal_force_slope")] * response(model, theta, s); }

double normal_tail(double z) { return 0.5 * std::erfc(z / std::numbers::sqrt2); }

TEST(IndicialResponse, ErrorsOfTheCoefficientAreThoseOfSlopeAndResponseTogether) {
  const AeroelasticModel model = free_model(VectorXd{{0.05, 0.4}});
  const Index parameters = static_cast<Index>(model.parameters().size()), slope = model.index("normal_force_slope"), first = model.circulation_parameter(0);
  VectorXd theta = model.start_values(), deviation = VectorXd::Constant(parameters, 1e-3);
  theta[slope] = 5.5;
  deviation[slope] = 0.11, deviation[first] = 0.02, deviation[first + 1] = 0.03;
  for (const double correlation : {0.0, 0.6, -0.6}) {
    MatrixXd covariance = deviation.cwiseAbs2().asDiagonal();
    covariance(slope, first) = covariance(first, slope) = correlation * deviation[slope] * deviation[first];
    const IndicialResponse r = indicial_response(model, theta, budget_of(covariance), 300, 8);
    for (Index i = 0; i < r.semichords.size(); i += 20) {
      VectorXd gradient = VectorXd::Zero(parameters);
      for (const Index j : {slope, first, first + 1}) {
        VectorXd up = theta, down = theta;
        up[j] += 1e-4, down[j] -= 1e-4;  // it is linear in each
        gradient[j] = (per_radian(model, up, r.semichords[i]) - per_radian(model, down, r.semichords[i])) / 2e-4;
      }
      EXPECT_NEAR(r.per_radian[i], per_radian(model, theta, r.semichords[i]), 1e-12);
      EXPECT_NEAR(r.per_radian_std[i], std::sqrt(gradient.dot(covariance * gradient)), 1e-6 * r.per_radian_std[i]) << r.semichords[i] << ", " << correlation;
    }
    // Far behind the step the response is 1 for sure, and what is left is the slope's own error.
    EXPECT_NEAR(r.per_radian_std.tail(1)[0], deviation[slope], 1e-5 * deviation[slope]);
  }
}

/// With one exponential the slope is as many standard deviations below zero everywhere, and there is one chance to look as falling: a one-sided one.
TEST(IndicialResponse, OneExponentialFallsWithTheProbabilityOfOneSide) {
  const AeroelasticModel model = free_model(VectorXd::Constant(1, 0.3));
  const Index parameters = static_cast<Index>(model.parameters().size()), amplitude = model.circulation_parameter(0);
  constexpr double deviation = 0.05;
  MatrixXd covariance = 1e-6 * MatrixXd::Identity(parameters, parameters);
  covariance(amplitude, amplitude) = deviation * deviation;
  const UncertaintyBudget budget = budget_of(covariance);
  VectorXd theta = model.start_values();
  for (const double z : {0.5, 1.0, 2.0, 3.5}) {
    theta[amplitude] = -z * deviation;
    const IndicialResponse r = indicial_response(model, theta, budget, 30, 8);
    EXPECT_TRUE(std::isfinite(r.steepest_fall));
    EXPECT_NEAR(r.monotone_p, normal_tail(z), 1e-6) << z;  // a curve of no length: rounding of its chords
  }
  theta[amplitude] = deviation;
  const IndicialResponse rising = indicial_response(model, theta, budget, 30, 8);
  EXPECT_TRUE(std::isinf(rising.steepest_fall));
  EXPECT_EQ(rising.monotone_p, 1);
}

/// A response that is 1 from the beginning neither rises nor falls. Of its estimates with two exponentials, whose slopes lie on an arc of less than half a circle, a tenth look as falling as a probability of
/// a tenth says: the formula is exact there.
TEST(IndicialResponse, OfLevelResponsesATenthFallsWithAProbabilityOfATenth) {
  const AeroelasticModel model = free_model(VectorXd{{0.05, 1.0}});
  const Index parameters = static_cast<Index>(model.parameters().size()), first = model.circulation_parameter(0);
  MatrixXd covariance = 1e-6 * MatrixXd::Identity(parameters, parameters);
  covariance.block(first, first, 2, 2) << 4e-4, -1e-4, -1e-4, 9e-4;
  const UncertaintyBudget budget = budget_of(covariance);
  const MatrixXd root = covariance.block(first, first, 2, 2).llt().matrixL();
  std::mt19937_64 random(4);
  std::normal_distribution<double> normal;
  constexpr int trials = 1500;
  int tenth = 0, half_a_tenth = 0;
  VectorXd theta = model.start_values();
  for (int i = 0; i < trials; ++i) {
    const double a = normal(random), b = normal(random);
    theta.segment(first, 2) = root * Eigen::Vector2d(a, b);
    const double p = indicial_response(model, theta, budget, 30, 8).monotone_p;
    tenth += p < 0.1 ? 1 : 0;
    half_a_tenth += p < 0.05 ? 1 : 0;
  }
  // Standard deviations of the counts: 11.6 and 8.4; three of them.
  EXPECT_NEAR(tenth, 0.1 * trials, 35);
  EXPECT_NEAR(half_a_tenth, 0.05 * trials, 26);
}

}  // namespace
}  // namespace unrig
