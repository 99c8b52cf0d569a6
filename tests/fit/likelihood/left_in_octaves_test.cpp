#include "fit/likelihood/left_in_octaves.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

constexpr double dt = 0.002;
constexpr double noise = 0.3;

VectorXd white(Index samples, unsigned seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal(0, noise);
  VectorXd x(samples);
  for (double& value : x) value = normal(random);
  return x;
}

/// Densities times the widths of their octaves.
VectorXd powers(const LeftInOctaves& left) {
  VectorXd power(left.density.size());
  double from = left.from, to = 2 * left.from;
  for (Index b = 0; b < power.size(); ++b, from = to, to *= 2) power[b] = left.density[b] * (std::min(to, 0.5 / dt) - from);
  return power;
}

TEST(LeftInOctaves, HoldsTheVarianceOfALineInItsOctave) {
  const Index samples = 4096;
  for (const Index line : {2, 5, 40, 1000}) {
    VectorXd x = white(samples, static_cast<unsigned>(line));
    for (Index k = 0; k < samples; ++k) x[k] += 2 * std::cos(2 * std::numbers::pi * static_cast<double>(line * k) / samples + 0.3);
    const LeftInOctaves left = left_in_octaves(x, VectorXd::Ones(samples), dt, noise);
    EXPECT_DOUBLE_EQ(left.from, 1 / (samples * dt));
    const VectorXd power = powers(left);
    Index largest = 0;
    // The amplitude of a line of 2 scatters by noise sqrt(2/n) = 0.0066: its power by 0.013. The white noise of the octave is taken off to some of its lines' scatter, 0.09 over all.
    EXPECT_NEAR(power.maxCoeff(&largest), 2, 0.06) << line;
    EXPECT_EQ(largest, static_cast<Index>(std::log2(static_cast<double>(line))));
    EXPECT_DOUBLE_EQ(left.at(static_cast<double>(line) * left.from), left.density[largest]);
  }
}

TEST(LeftInOctaves, IsNothingOfWhiteNoise) {
  const Index samples = 4096;
  double sum = 0;
  const int seeds = 40;
  for (unsigned seed = 1; seed <= seeds; ++seed) sum += powers(left_in_octaves(white(samples, seed), VectorXd::Ones(samples), dt, noise)).sum();
  // Half of the octaves are below their noise and count 0: of the last one, half of all lines, sqrt(1/1024) / sqrt(2 pi) of its power is left on average, 1.3 % of half, and a like part of each octave.
  EXPECT_LT(sum / seeds, 0.04 * noise * noise);
}

TEST(LeftInOctaves, DoesNotCountWhatIsLeftOut) {
  const Index samples = 3000;
  VectorXd x = white(samples, 7), weight = VectorXd::Ones(samples);
  for (Index k = 0; k < samples; ++k) x[k] += 3 * std::sin(2 * std::numbers::pi * 1.3 * dt * static_cast<double>(k));
  const double whole = powers(left_in_octaves(x, weight, dt, noise)).sum();
  for (Index k = 0; k < samples; k += 3) weight[k] = 0, x[k] = std::nan("");
  EXPECT_NEAR(powers(left_in_octaves(x, weight, dt, noise)).head(5).sum() / whole, 2.0 / 3, 0.05);  // transform of two thirds of a slow wave: its line has 4/9 of the power, over 2/3 of the samples
}

TEST(LeftInOctaves, HasNoOctavesOfAHandfulOfReadings) {
  EXPECT_EQ(left_in_octaves(white(7, 1), VectorXd::Ones(7), dt, noise).density.size(), 0);
  EXPECT_EQ(LeftInOctaves{}.at(3), 0);
}

TEST(LeftInOctaves, HasNoneOfAModelThatRunsAway) {
  VectorXd x = white(100, 1);
  x[50] = INFINITY;
  EXPECT_EQ(left_in_octaves(x, VectorXd::Ones(100), dt, noise).density.size(), 0);
}

TEST(LeftInOctaves, GoesOnBelowAndAboveItsOctaves) {
  const LeftInOctaves left{0.5, VectorXd::LinSpaced(3, 1, 3)};
  for (const auto& [frequency, density] : {std::pair{0.0, 1.0}, {0.99, 1.0}, {1.0, 2.0}, {1.99, 2.0}, {2.0, 3.0}, {100.0, 3.0}}) EXPECT_EQ(left.at(frequency), density) << frequency;
}

}  // namespace
}  // namespace unrig
