#include "fit/uncertainty/coloured_noise.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "tests/fit/run_cases.h"

namespace unrig::run_cases {
namespace {

/// x_k = memory x_(k-1) + white noise, of standard deviation 1.
VectorXd autoregression(Index count, double memory, unsigned seed) {
  std::mt19937_64 engine(seed);
  std::normal_distribution<double> normal;
  VectorXd x(count);
  double state = normal(engine);
  for (double& value : x) value = state = memory * state + std::sqrt(1 - memory * memory) * normal(engine);
  return x;
}

TEST(ColouredNoise, AMeanSeesThePowerAtFrequencyZero) {
  // The variance of the mean of n samples is S(0) / n, S(0) = (1 + a) / (1 - a) of this noise, up to a share of (a / (1 - a)) / n.
  constexpr Index n = 4000;
  constexpr double memory = 0.6;
  const double expected = (1 + memory) / (1 - memory) / static_cast<double>(n);
  double found = 0;
  constexpr int draws = 20;
  for (unsigned seed = 1; seed <= draws; ++seed) {
    VectorXd noise = autoregression(n, memory, seed);
    noise.array() -= noise.mean();  // as the offset does
    RunResidual::Sensitivity sensitivity;
    sensitivity.channels.push_back({noise, MatrixXd::Zero(n, 1), VectorXd::Constant(n, 1.0 / static_cast<double>(n))});
    found += coloured_covariance(sensitivity, {noise}, MatrixXd::Zero(1, 1), 0, MatrixXd::Zero(1, 1)).covariance(0, 0) / draws;
  }
  // Three lines tell a variance to 58 %. Of these and the autoregression the larger counts: 23 % more in the mean, if the latter is right, which 20 draws tell to 8 %.
  EXPECT_NEAR(found / expected, 1.23, 0.25);
}

TEST(ColouredNoise, ReachesAnOffsetDirectlyAndByWayOfTheta) {
  // What the noise does to the offset by way of theta cancels nearly all of what it does directly: a mean is left.
  constexpr Index n = 500;
  const VectorXd noise = autoregression(n, 0.8, 3), mean = VectorXd::Constant(n, 1.0 / static_cast<double>(n)), wave = VectorXd::LinSpaced(n, 0, 9).array().sin();
  RunResidual::Sensitivity sensitivity;
  sensitivity.channels.push_back({noise, wave, mean - wave});
  const auto covariance = [&](double follows) { return coloured_covariance(sensitivity, {noise}, (MatrixXd(2, 1) << 1, follows).finished(), 1, MatrixXd::Zero(1, 1)).covariance; };
  const MatrixXd apart = covariance(0), together = covariance(1);
  EXPECT_NEAR(together(1, 1) / (apart(0, 0) + 2 * apart(0, 1) + apart(1, 1)), 1, 1e-6);  // of numbers that cancel to a few thousandths
  EXPECT_LT(together(1, 1), 0.01 * apart(0, 0));
}

TEST(ColouredNoise, IsThatOfRestsWhereKnotsTakeAMotionsNoise) {
  VectorXd residual = white_noise(600, 1, 4);
  residual.segment(200, 150) *= 0.1;
  const std::vector<MotionBasis::Phase> phases{{{0, 200}, false}, {{200, 350}, true}, {{350, 600}, false}};
  const VectorXd rests = residual_at_rest(residual, phases, 150);
  EXPECT_TRUE(rests.segment(200, 150).isZero(0));
  EXPECT_EQ(rests.head(200), residual.head(200));
  residual.segment(200, 150) *= 100;  // what the model misses counts
  EXPECT_EQ(residual_at_rest(residual, phases, 150), residual);
  const std::vector<MotionBasis::Phase> restless{{{0, 50}, false}, {{50, 600}, true}};
  EXPECT_NEAR(residual_at_rest(residual, restless, 300).norm() / residual.norm(), std::sqrt(2.0), 1e-12) << "300 unknowns may have taken half";
}

TEST(ColouredNoise, IsNotSeenInWhatIsLeftOut) {
  VectorXd residual = white_noise(1000, 1, 5);
  residual.segment(300, 400).setZero();
  EXPECT_GT(whiteness({residual}), 0.01);
  EXPECT_LT(whiteness({autoregression(1000, 0.5, 6)}), 1e-6);
}

TEST(ColouredNoise, WhatNoiseDoesToAnOffsetIsThatOfAllSamplesAndUnknowns) {
  for (const Case& c : every_case()) {
    const RunResidual residual = c.residual();
    const Dense dense = brute_force(c, residual);
    const RunResidual::Sensitivity sensitivity = residual.sensitivity(c.theta);
    const VectorXd scale = dense.columns.colwise().norm().cwiseInverse();
    const Index offset = residual.first_offset(), n = c.run.samples();
    // The row of the pseudo-inverse that belongs to the offset.
    const MatrixXd inverse = (dense.columns * scale.asDiagonal()).completeOrthogonalDecomposition().pseudoInverse();
    const VectorXd row = scale[offset] * inverse.row(offset).transpose();
    Index at = 0;
    for (const auto& channel : sensitivity.channels) {
      EXPECT_LT((channel.into_offset - row.segment(at, n)).norm(), 1e-6 * row.norm()) << c.name;  // as the linear unknowns themselves
      at += n;
    }
    EXPECT_EQ(at, row.size());
  }
}

/// Of 2000 records of white noise as many as its probability says have so strong a line: it is a bound, which looks between the lines as well.
TEST(StrongestLine, IsAsRareInWhiteNoiseAsItSays) {
  constexpr int records = 2000;
  for (const double level : {0.1, 0.01}) {
    int rarer = 0;
    for (unsigned seed = 0; seed < records; ++seed) rarer += strongest_line(white_noise(501, 1, seed)).p_value < level ? 1 : 0;
    const double expected = level * records, spread = 3 * std::sqrt(expected);
    EXPECT_LT(rarer, expected + spread) << level;
    EXPECT_GT(rarer, 0.5 * expected - spread) << level << ": half of the places between lines are not independent of them";
  }
}

/// Wherever it lies between the lines of the record, with samples left out too.
TEST(StrongestLine, IsFoundAtItsFrequency) {
  constexpr Index samples = 1000;
  for (const double cycles : {60.0, 60.25, 60.5, 141.3}) {
    VectorXd residual = white_noise(samples, 1, 3);
    for (Index k = 0; k < samples; ++k) residual[k] += 0.5 * std::sin(2 * 3.14159265358979323846 * cycles * static_cast<double>(k) / samples);
    residual.segment(400, 50).setZero();
    const Line line = strongest_line(residual);
    EXPECT_NEAR(line.place * samples, cycles, 0.5) << cycles;
    EXPECT_LT(line.p_value, 1e-10) << cycles;
    EXPECT_GT(line.over_mean, 30) << cycles << ": n a^2 / 4 is 62, of which a place a quarter of a line away shows four fifths";
  }
  // In a band: a stronger one outside it does not count, nor for what lies around.
  VectorXd two = white_noise(samples, 1, 3);
  for (Index k = 0; k < samples; ++k) two[k] += 0.5 * std::sin(2 * 3.14159265358979323846 * 200 * static_cast<double>(k) / samples) + 50 * std::sin(2 * 3.14159265358979323846 * 20 * static_cast<double>(k) / samples);
  const Line line = strongest_line(two, 0.19, 0.21);
  EXPECT_NEAR(line.place, 0.2, 0.5 / samples);
  EXPECT_LT(line.p_value, 1e-8);
  EXPECT_GT(strongest_line(two, 0.29, 0.31).p_value, 1e-3);
  EXPECT_EQ(strongest_line(VectorXd::Zero(100)).p_value, 1);
  EXPECT_EQ(strongest_line(white_noise(8, 1, 1)).p_value, 1);
}

}  // namespace
}  // namespace unrig::run_cases
