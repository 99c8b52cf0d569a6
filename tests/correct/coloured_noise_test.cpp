#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "tests/correct/null_campaign.h"

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

constexpr double true_onset = 1.0;

/// Noise that wanders: three first-order processes, whose corners and sizes are none of the model's, beside the white noise of the recordings (0.026 N).
VectorXd wandering(Index samples, double dt, unsigned seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  VectorXd noise = VectorXd::Zero(samples);
  for (const auto& [corner, size] : {std::pair{0.13, 0.03}, {1.7, 0.03}, {11.0, 0.02}}) {
    const double pole = std::exp(-2 * std::numbers::pi * corner * dt);
    double part = size * normal(random);
    for (Index k = 0; k < samples; ++k) {
      noise[k] += part;
      part = pole * part + size * std::sqrt(1 - pole * pole) * normal(random);
    }
  }
  return noise;
}

/// Bands that take the noise for white hold in 38 % of these samples; generalised least squares knows what wanders.
TEST(ColouredNoise, IsInTheBandOfTheLoad) {
  double held = 0, samples = 0;
  for (const std::string name : {"step_a", "step_b", "step_c"})
    for (const unsigned seed : {1u, 2u, 3u, 4u}) {
      CorrectProblem problem = test::null_problem(name);
      Channel& gauge = *std::find_if(problem.run.channels.begin(), problem.run.channels.end(), [](const Channel& c) { return c.name == "gauge"; });
      gauge.value += wandering(gauge.value.size(), problem.run.dt, seed);
      const CorrectResult result = correct(problem);
      EXPECT_NEAR(result.reduced_chi2, 1, 0.08) << name << ", " << seed;
      EXPECT_THAT(result.warnings, testing::Contains(testing::HasSubstr("coloured")));
      const VectorXd truth = test::column_of(test::null_campaign("truth_" + name + ".csv"), "circulatory");
      for (Index k = 0; k < truth.size(); ++k) {
        const double semichords = (problem.run.time(k) - true_onset) * result.semichords_per_second;
        if (semichords < 0.5 || semichords > 8) continue;
        ++samples;
        held += std::abs(result.circulatory.value[k] - truth[k]) <= 1.96 * result.circulatory.std[k] ? 1 : 0;
      }
    }
  // The errors of one run are one error: of twelve runs, each within its band in 95 of 100, three outside happen once in fifty.
  EXPECT_GT(held / samples, 0.8);
}

TEST(ColouredNoise, IsNotSeenWhereItIsWhite) {
  for (const std::string name : {"step_a", "step_b", "step_c"}) EXPECT_THAT(correct(test::null_problem(name)).warnings, testing::Not(testing::Contains(testing::HasSubstr("coloured")))) << name;
}

}  // namespace
}  // namespace unrig
