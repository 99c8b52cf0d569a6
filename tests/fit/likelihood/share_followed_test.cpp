// How much of a reading a prediction follows, and of which part of it, on signals whose shares are known.

#include "fit/likelihood/share_followed.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

constexpr double pi = 3.14159265358979;
constexpr Index many = 200000;

VectorXd signal(Index samples, double (*f)(double)) {
  return VectorXd::NullaryExpr(samples, [&](Index k) { return f(0.005 * static_cast<double>(k)); });
}

/// A decay that is over within a hundredth of `many` samples.
double ring(double t) { return 10 * std::exp(-0.9 * t) * std::cos(2 * pi * 4.8 * t); }
double ring_elsewhere(double t) { return 10 * std::exp(-0.9 * t) * std::cos(2 * pi * 5.6 * t); }
double three_tones(double t) { return std::cos(2 * pi * 3 * t) + std::cos(2 * pi * 3.1 * t) + std::cos(2 * pi * 3.2 * t); }
double one_of_them(double t) { return std::cos(2 * pi * 3.1 * t); }

/// Noise of standard deviation one, each sample nine tenths of the one before.
VectorXd coloured_noise(Index samples) {
  std::mt19937 random(5);
  std::normal_distribution<double> normal;
  VectorXd x = VectorXd::Zero(samples);
  for (Index k = 1; k < samples; ++k) x[k] = 0.9 * x[k - 1] + std::sqrt(1 - 0.81) * normal(random);
  return x;
}

TEST(ShareFollowed, IsThatOfTheVariance) {
  const VectorXd y = signal(1000, ring), weight = VectorXd::Ones(1000);
  EXPECT_EQ(share_followed(y, y, weight), 1);
  EXPECT_EQ(share_followed(y, VectorXd::Constant(1000, y.mean()), weight), 0);
  const VectorXd most = 0.9 * y.array() + 0.1 * y.mean();
  EXPECT_NEAR(share_followed(y, most, weight), 0.99, 1e-12);  // a tenth of the amplitude is left
  EXPECT_LT(share_followed(y, -y, weight), -2.9);
}

TEST(ShareFollowed, AConstantOrNothingIsFollowed) {
  EXPECT_EQ(share_followed(VectorXd::Ones(100), VectorXd::Zero(100), VectorXd::Ones(100)), 1);
  EXPECT_EQ(share_followed(signal(100, ring), VectorXd::Zero(100), VectorXd::Zero(100)), 1);
}

TEST(ShareFollowed, SamplesWithoutWeightDoNotCount) {
  VectorXd y = signal(1000, ring), weight = VectorXd::Ones(1000);
  const VectorXd prediction = y;
  for (const Index k : {3, 400, 999}) y[k] = std::numeric_limits<double>::quiet_NaN(), weight[k] = 0;
  EXPECT_EQ(share_followed(y, prediction, weight), 1);
}

TEST(ShareFollowed, ADecayInALongRecordOfNoiseIsJudgedWhereItRings) {
  const VectorXd y = signal(many, ring) + coloured_noise(many), weight = VectorXd::Ones(many);
  // Of the whole, the decay is 50 / 1.8 s over 1000 s: 2.7 % beside a noise of one.
  EXPECT_GT(share_followed(y, signal(many, ring), weight), 0.95);
  EXPECT_GT(share_followed(y, 0.7 * signal(many, ring), weight), 0.85) << "nine hundredths of the power are left";
  EXPECT_LT(share_followed(y, 0.3 * signal(many, ring), weight), 0.1) << "half of the power is left";
}

TEST(ShareFollowed, TheWrongDecayIsNotFollowedHoweverLongTheNoise) {
  const VectorXd y = signal(many, ring) + coloured_noise(many), weight = VectorXd::Ones(many);
  EXPECT_LT(share_followed(y, signal(many, ring_elsewhere), weight), 0.1);
  EXPECT_LT(share_followed(y, VectorXd::Zero(many), weight), 0.01);
}

TEST(ShareFollowed, NoiseAloneIsNotFollowed) {
  const VectorXd y = coloured_noise(many), weight = VectorXd::Ones(many);
  EXPECT_LT(share_followed(y, VectorXd::Zero(many), weight), 0.01);
  EXPECT_NEAR(share_followed(y, signal(many, ring), weight), -0.027, 0.01);
}

TEST(ShareFollowed, TheCrestsOfABeatAreNoAnswer) {
  const VectorXd y = signal(20000, three_tones), weight = VectorXd::Ones(20000);
  EXPECT_NEAR(share_followed(y, signal(20000, one_of_them), weight), 1. / 3, 0.01);
}

}  // namespace
}  // namespace unrig
