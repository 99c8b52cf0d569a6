#include "fit/force/run_states.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "fit/diagnose/separating.h"
#include "fit/search/effect_search.h"
#include "fit/fit.h"
#include "tests/support/sample_data.h"

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::VectorXd;
using std::numbers::pi;

constexpr Index samples = 30000;

std::vector<RunState> oscillation() {
  const VectorXd phase = VectorXd::LinSpaced(samples, 0, 2 * pi * 100);
  return {{"displacement", phase.array().cos()}, {"velocity", phase.array().sin()}};
}

VectorXd white_noise(unsigned seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  return VectorXd::NullaryExpr(samples, [&] { return normal(random); });
}

TEST(RunStates, ForceQuadraticInTheVelocityIsFoundThere) {
  const std::vector<RunState> states = oscillation();
  const VectorXd& v = states[1].value;
  const auto found = depends_on(states, white_noise(1) - VectorXd(20 * v.array() * v.array().abs()));
  ASSERT_TRUE(found);
  EXPECT_EQ(found->state, "velocity");
  // int sin^4 from pi/3 to 2 pi/3 over that from 0 to pi, and <|sin|^3> / sqrt(<sin^4> <sin^2>); the noise is a hundredth of the power.
  EXPECT_NEAR(found->share, (pi / 8 + 9 * std::sqrt(3.0) / 32) / (3 * pi / 8), 0.01);
  EXPECT_NEAR(found->follows, -(4 / (3 * pi)) / std::sqrt(0.375 * 0.5), 0.01);
}

TEST(RunStates, ADisturbanceThatKnowsNoStateDependsOnNone) {
  const VectorXd hum = VectorXd::LinSpaced(samples, 0, 2 * pi * 1234.5).array().sin();
  EXPECT_FALSE(depends_on(oscillation(), white_noise(2) + 3 * hum));
  EXPECT_FALSE(depends_on(oscillation(), white_noise(3)));
}

TEST(RunStates, StandardDeviationOfTheShareHoldsUnderWhiteNoise) {
  // The top third of a cosine of uniform phase lies within pi/6 of its peaks.
  const std::vector<RunState> states = {oscillation()[0]};
  constexpr int runs = 60;
  constexpr double strength = 2;
  double square = 0;
  for (unsigned seed = 0; seed < runs; ++seed) {
    const VectorXd hum = VectorXd::LinSpaced(samples, 0.3 * seed, 0.3 * seed + 2 * pi * 4321.5).array().sin();
    VectorXd left = white_noise(100 + seed) + strength * hum;
    double power = 0;
    for (Index k = 0; k < samples; ++k)
      if (std::abs(states[0].value[k]) > std::cos(pi / 6)) power += left[k] * left[k] - 1;
    const double excess = left.squaredNorm() - samples;
    square += std::pow((power / excess - 1.0 / 3) / (std::sqrt(4.0 * samples / 9) / excess), 2) / runs;
  }
  // White noise alone would give 1; its product with the hum adds 4 strength^2 / 2 to the variance 2 of its square.
  EXPECT_NEAR(std::sqrt(square), std::sqrt(1 + strength * strength), 3 * std::sqrt((1 + strength * strength) / (2.0 * runs)));
}

TEST(SeparatingRecording, TellsDragFromNoneByAStrongerPluck) {
  FitProblem problem;
  problem.rig = read_rig(test::null_campaign("rig.toml"));
  for (const char* run : {"dry_pluck.csv", "wet_pluck.csv"}) problem.runs.push_back(read_run(test::null_campaign(run)));
  const Trial without = fit_baseline(problem);
  Trial with = prepare(problem, without, {"quadratic-drag"});
  ASSERT_EQ(unknowns_of(with.arrival.joint, "quadratic-drag").size(), 1u);
  unknowns_of(with.arrival.joint, "quadratic-drag").front()->value = 0.01;
  const auto found = separating_recording(without.arrival, with.arrival);
  ASSERT_TRUE(found);
  EXPECT_NE(found->what.find("wet_pluck.csv released from 3 times the load"), std::string::npos) << found->what;
  // The force goes with the square of the motion, and so does what a weak one makes of it.
  EXPECT_NEAR(found->difference / found->now, 9, 0.9);
}

TEST(SeparatingRecording, NoneForTwoFitsThatAreOne) {
  FitProblem problem;
  problem.rig = read_rig(test::null_campaign("rig.toml"));
  for (const char* run : {"wet_pluck.csv", "step_a.csv"}) problem.runs.push_back(read_run(test::null_campaign(run)));
  const Trial fit = fit_baseline(problem);
  EXPECT_FALSE(separating_recording(fit.arrival, fit.arrival));
}

}  // namespace
}  // namespace unrig
