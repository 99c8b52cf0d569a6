#include "fit/diagnose/maps.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

VectorXd noise(Index n, unsigned seed) {
  std::mt19937_64 engine(seed);
  std::normal_distribution<double> normal;
  return VectorXd::NullaryExpr(n, [&] { return normal(engine); });
}

TEST(Maps, WhiteNoiseHasAPowerOfOneEverywhere) {
  const TimeFrequencyMap map = time_frequency(noise(6000, 1), 3, 0.002);
  EXPECT_LE(map.power.rows(), 96);
  EXPECT_GE(map.power.cols(), 90);
  // About 12 independent Hann windows of 500 lines each: the mean of 6000 exponential numbers is within 5/sqrt(6000) of 1.
  EXPECT_NEAR(map.power.mean(), 1, 0.065);
  EXPECT_NEAR(map.time.mean(), 3 + 0.002 * 5999 / 2, 0.02) << "the windows lie evenly over the record, but for a step";
  EXPECT_GT(map.frequency.maxCoeff(), 240) << "where nothing stands out, all is shown";
  EXPECT_FALSE(map.noise_above);
}

TEST(Maps, AToneStandsWhereItSounds) {
  constexpr double hertz = 7.5, dt = 0.002;
  VectorXd x = noise(6000, 2);
  for (Index k = 2000; k < 4000; ++k) x[k] += 3 * std::sin(2 * std::numbers::pi * hertz * dt * static_cast<double>(k));
  const TimeFrequencyMap map = time_frequency(x, 0, dt);
  Index line = 0, window = 0;
  map.power.maxCoeff(&line, &window);
  EXPECT_NEAR(map.frequency[line], hertz, 0.6) << "lines are half a hertz apart";
  EXPECT_GT(map.time[window], 4 + 1);  // the window of 2 s lies inside the tone
  EXPECT_LT(map.time[window], 8 - 1);
  EXPECT_LT(map.frequency.maxCoeff(), 25) << "only noise above";
  EXPECT_TRUE(map.noise_above);
  EXPECT_LT(map.power.col(0).maxCoeff(), 20) << "not yet there";
}

TEST(Maps, TheRestoringForceIsWhatWasPutIn) {
  const Index n = 20000;
  VectorXd x(n), v(n), force(n);
  const VectorXd e = noise(n, 3);
  for (Index k = 0; k < n; ++k) {
    const double t = 0.01 * static_cast<double>(k), a = 1 - t / 250;
    x[k] = a * std::sin(t);
    v[k] = a * std::cos(t);
    force[k] = -0.8 * std::abs(v[k]) * v[k] + 0.3 * x[k] + 0.02 * e[k];
  }
  const RestoringForceMap map = restoring_force(x, v, force);
  Index cells = 0;
  for (Index i = 0; i < map.velocity.size(); ++i)
    for (Index j = 0; j < map.displacement.size(); ++j) {
      if (!std::isfinite(map.force(i, j))) continue;
      ++cells;
      // Half a cell (0.048) off in both, at slopes of at most 1.6 and 0.3, and five standard deviations of the mean of three.
      EXPECT_NEAR(map.force(i, j), -0.8 * std::abs(map.velocity[i]) * map.velocity[i] + 0.3 * map.displacement[j], 1.9 * 0.048 + 5 * 0.02 / std::sqrt(3.0));
    }
  EXPECT_GT(cells, 150);
}

}  // namespace
}  // namespace unrig
