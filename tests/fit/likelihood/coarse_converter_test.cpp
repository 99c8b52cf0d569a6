#include "fit/likelihood/coarse_converter.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

constexpr double step = 0.2;
constexpr Index samples = 4000;

/// What a converter reads of a signal with white noise.
VectorXd read(const VectorXd& signal, double noise, unsigned seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal(0, noise);
  return signal.unaryExpr([&](double s) { return step * std::round((s + normal(random)) / step); });
}

VectorXd swing(double amplitude) {
  return VectorXd::NullaryExpr(samples, [&](Index k) { return amplitude * std::sin(0.01 * static_cast<double>(k)); });
}

TEST(CoarseConverter, HasThreeAndAHalfDeviationsToAStepAtLeast) {
  const VectorXd signal = swing(3);
  for (const double share : {0.5, 0.33}) EXPECT_EQ(coarse_converter(read(signal, share * step, 1), std::sqrt(share * share + 1.0 / 12) * step).step, 0) << share;
  for (const double share : {0.25, 0.1, 0.01}) EXPECT_NEAR(coarse_converter(read(signal, share * step, 1), std::sqrt(share * share + 1.0 / 12) * step).step, step, 1e-9) << share;
  EXPECT_EQ(coarse_converter(signal, 0.1 * step).step, 0);  // a reading of no steps
}

TEST(CoarseConverter, MakesLittleBeyondHalfAStep) {
  for (const double level : {0.0, 0.03, 0.06, 0.09}) {  // rests anywhere within a step
    for (const double amplitude : {0.0, 0.05, 3.0}) {
      for (const double noise : {0.05, 0.15, 0.28}) {
        const VectorXd signal = swing(amplitude).array() + level;
        const CoarseConverter converter{step};
        const VectorXd left = read(signal, noise * step, 2) - signal;
        EXPECT_LT(converter.beyond(left).squaredNorm() / samples, 1) << level << " " << amplitude << " " << noise;
        EXPECT_LE(converter.error(left), step / 2);
      }
    }
  }
}

TEST(CoarseConverter, BeyondHalfAStepNoiseOfAThirdLeavesOne) {
  std::mt19937_64 random(4);
  std::normal_distribution<double> normal(0, step * std::sqrt(1.0 / 9 + 1.0 / 12));
  const VectorXd noise = VectorXd::NullaryExpr(100 * samples, [&] { return normal(random); });
  EXPECT_NEAR(CoarseConverter{step}.beyond(noise).squaredNorm() / static_cast<double>(noise.size()), 1, 0.03);
}

TEST(CoarseConverter, HidesNoMismatchOfAStep) {
  const VectorXd signal = swing(3), left = read(1.07 * signal, step / 6, 3) - signal;  // up to a step off
  EXPECT_GT(CoarseConverter{step}.beyond(left).squaredNorm() / samples, 1.2);
}

TEST(CoarseConverter, AFineOneHasNoError) {
  EXPECT_EQ(CoarseConverter().error(swing(1)), 0);
}

}  // namespace
}  // namespace unrig
