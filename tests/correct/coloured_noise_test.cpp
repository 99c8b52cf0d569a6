#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
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

/// A run of the null campaign with such noise on top of its own.
unrig::Run noisy_run(const std::string& name, unsigned seed) {
  unrig::Run run = read_run(test::null_campaign(name + ".csv"));
  Channel& gauge = *std::find_if(run.channels.begin(), run.channels.end(), [](const Channel& c) { return c.name == "gauge"; });
  gauge.value += wandering(gauge.value.size(), run.dt, seed);
  return run;
}

/// Bands that take such noise for white are too narrow (tests/studies/COLOURED_NOISE.md). Five runs together show what wanders, and the correction of each knows it from their fit.
TEST(ColouredNoise, IsInTheBandOfTheLoad) {
  double held = 0, samples = 0;
  for (const unsigned seed : {1u, 2u}) {
    FitProblem fitted;
    fitted.rig = test::null_rig();
    unsigned run_seed = 10 * seed;
    for (const std::string name : {"dry_pluck", "wet_pluck", "step_a", "step_b", "step_c"}) fitted.runs.push_back(noisy_run(name, run_seed++));
    const FitResult result_of_fit = fit(fitted);
    ASSERT_EQ(result_of_fit.noise_colour.size(), 1u);
    EXPECT_EQ(result_of_fit.noise_colour.front().channel, "gauge");
    const test::TemporaryDirectory directory;
    const FittedRig known = read_fit(directory.file("fit.json", to_json(result_of_fit)));
    for (const std::size_t step : {2u, 3u, 4u}) {
      const CorrectResult result = correct({fitted.rig, known, fitted.runs[step], 0});
      const std::string name = std::array{"", "", "step_a", "step_b", "step_c"}[step];
      EXPECT_NEAR(result.reduced_chi2, 1, 0.08) << name << ", " << seed;  // some 5500 readings: three times 2 %, and what the level is known to
      EXPECT_THAT(result.warnings, testing::Contains(testing::HasSubstr("coloured")));
      const VectorXd truth = test::column_of(test::null_campaign("truth_" + name + ".csv"), "circulatory");
      for (Index k = 0; k < truth.size(); ++k) {
        const double semichords = (fitted.runs[step].time(k) - true_onset) * result.semichords_per_second;
        if (semichords < 0.5 || semichords > 8) continue;
        ++samples;
        held += std::abs(result.circulatory.value[k] - truth[k]) <= 1.96 * result.circulatory.std[k] ? 1 : 0;
      }
    }
  }
  // The errors of one run are one error: of six runs, each within its band in 95 of 100, two outside happen once in thirty.
  EXPECT_GT(held / samples, 0.66);
}

TEST(ColouredNoise, IsNotSeenWhereItIsWhite) {
  for (const std::string name : {"step_a", "step_b", "step_c"}) EXPECT_THAT(correct(test::null_problem(name)).warnings, testing::Not(testing::Contains(testing::HasSubstr("coloured")))) << name;
}

}  // namespace
}  // namespace unrig
