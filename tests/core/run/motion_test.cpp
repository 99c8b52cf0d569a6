#include "core/run/motion.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>
#include <stdexcept>
#include <vector>

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using std::numbers::pi;

constexpr double nan = std::numeric_limits<double>::quiet_NaN();

VectorXd white_noise(Index samples, double sigma, unsigned seed) {
  std::mt19937_64 engine(seed);
  std::normal_distribution<double> normal(0, sigma);
  return VectorXd::NullaryExpr(samples, [&] { return normal(engine); });
}

/// The cubic B-spline on [0, 4], piece by piece.
double b_spline(double x) {
  if (x <= 0 || x >= 4) return 0;
  if (x > 2) return b_spline(4 - x);
  if (x <= 1) return x * x * x / 6;
  return (1 + 3 * (x - 1) + 3 * (x - 1) * (x - 1) - 3 * (x - 1) * (x - 1) * (x - 1)) / 6;
}

// ---------------------------------------------------------------------------------------------------------------- the spline

TEST(MotionOf, IsASumOfBSplines) {
  const double dt = 0.01;
  const VectorXd c = white_noise(30, 1, 1);
  const Motion m = motion_of(c, dt);
  for (Index k = 0; k < 30; ++k) {
    double angle = 0;
    for (Index j = 0; j < 30; ++j) angle += c[j] * b_spline(static_cast<double>(k - j));
    EXPECT_NEAR(m.angle[k], angle, 1e-15) << k;
  }
}

TEST(MotionOf, EverySampleLeadsToTheNextAsACubicDoes) {
  const double dt = 0.002;
  const VectorXd c = white_noise(50, 1, 2);
  const Motion m = motion_of(c, dt);
  for (Index k = 0; k + 1 < 50; ++k) {
    const double p = m.angle[k], r = m.rate[k], a = m.acceleration[k], j = m.jerk[k];
    EXPECT_NEAR(m.angle[k + 1], p + dt * (r + dt * (a / 2 + dt * j / 6)), 1e-14) << k;
    EXPECT_NEAR(m.rate[k + 1], r + dt * (a + dt * j / 2), 1e-14 / dt) << k;
    EXPECT_NEAR(m.acceleration[k + 1], a + dt * j, 1e-14 / (dt * dt)) << k;
  }
}

TEST(MotionOf, EqualCoefficientsAreAnAngleAtRest) {
  const Motion m = motion_of(VectorXd::Constant(20, 1.5), 0.01);
  for (Index k = 3; k < 20; ++k) {
    EXPECT_NEAR(m.angle[k], 1.5, 1e-15) << "the splines are a partition of unity";
    EXPECT_EQ(m.rate[k], 0);
    EXPECT_EQ(m.acceleration[k], 0);
    EXPECT_EQ(m.jerk[k], 0);
  }
}

TEST(MotionBasis, ColumnsAreTheMotionsOfTheUnknowns) {
  for (const Index stride : {1, 2, 3}) {
    const MotionBasis basis(80, {{{10, 10 + 4 * stride}, stride}, {{45, 45 + 3 * stride}, stride}});
    ASSERT_EQ(basis.unknowns(), 4 + 1 + 3 + 1);  // a level follows each window
    const MatrixXd columns = basis.angle_columns({0, 80}), part = basis.angle_columns({20, 60});
    EXPECT_EQ(part, columns.middleRows(20, 40));
    for (Index j = 0; j < basis.unknowns(); ++j) {
      const VectorXd angle = motion_of(basis.coefficients(VectorXd::Unit(basis.unknowns(), j)), 0.01).angle;
      EXPECT_LT((columns.col(j) - angle).norm(), 1e-14) << "stride " << stride << ", unknown " << j;
    }
  }
}

TEST(MotionBasis, CoarserSplinesAreExactSumsOfFineOnes) {
  for (const Index stride : {1, 2, 3, 5}) {
    constexpr Index samples = 60, first = 7, count = 6;
    const MotionBasis basis(samples, {{{first, first + count * stride}, stride}});
    ASSERT_EQ(basis.unknowns(), count + 1);
    const MatrixXd columns = basis.angle_columns({0, samples});
    for (Index j = 0; j < count; ++j)
      for (Index k = 0; k < samples; ++k) {
        const double x = static_cast<double>(k - first - j * stride) / static_cast<double>(stride);
        EXPECT_NEAR(columns(k, j), b_spline(x), 1e-15) << "stride " << stride << ", spline " << j << ", sample " << k;
      }
  }
}

TEST(MotionBasis, LevelIsEveryFurtherSplineAtOnce) {
  for (const Index stride : {1, 2, 3}) {
    constexpr Index samples = 70, first = 5, count = 4;
    const MotionBasis basis(samples, {{{first, first + count * stride}, stride}});
    const VectorXd level = basis.angle_columns({0, samples}).col(count);
    for (Index k = 0; k < samples; ++k) {
      double expected = 0;
      for (Index j = count; first + j * stride < samples; ++j) expected += b_spline(static_cast<double>(k - first - j * stride) / static_cast<double>(stride));
      EXPECT_NEAR(level[k], expected, 1e-15) << "stride " << stride << ", sample " << k;
    }
    // All unknowns at 1: an angle that rises once and stays, by the partition of unity.
    const VectorXd angle = motion_of(basis.coefficients(VectorXd::Ones(count + 1)), 0.01).angle;
    for (Index k = 0; k <= first; ++k) EXPECT_EQ(angle[k], 0);
    for (Index k = first + 3 * stride; k < samples; ++k) EXPECT_NEAR(angle[k], 1, 1e-15);
  }
}

TEST(MotionBasis, NothingMovesOutsideTheActiveSamples) {
  for (const Index stride : {1, 2}) {
    const MotionBasis basis(100, {{{10, 20}, stride}, {{60, 70}, stride}});
    const std::vector<Interval> active = basis.active();
    ASSERT_EQ(active.size(), 2u);
    const Motion m = motion_of(basis.coefficients(white_noise(basis.unknowns(), 1, 3)), 0.01);
    for (Index k = 0; k < 100; ++k) {
      const bool inside = (k >= active[0].first && k < active[0].last) || (k >= active[1].first && k < active[1].last);
      if (inside) continue;
      EXPECT_NEAR(m.jerk[k], 0, 1e-8) << "sample " << k;  // cancellation: 1e-16 / dt^3, dt = 0.01
    }
  }
}

TEST(MotionBasis, RefusesAWindowWithoutKnots) {
  EXPECT_THROW(MotionBasis(50, {{{10, 10}, 1}}), std::invalid_argument);
  EXPECT_THROW(MotionBasis(50, {{{10, 12}, 3}}), std::invalid_argument);
  EXPECT_THROW(MotionBasis(50, {{{10, 20}, 0}}), std::invalid_argument);
  EXPECT_THROW(MotionBasis(50, {{{-1, 20}, 1}}), std::invalid_argument);
}

// ---------------------------------------------------------------------------------------------------------------- noise

/// Differences of order 6 correlate: rho_k = C(12, 6 + k) / C(12, 6), sum of rho_k^2 = C(24, 12) / C(12, 6)^2 = 3.17. The mean square of n of them
/// then has a relative standard deviation of sqrt(2 x 3.17 / n), the level half of that. Four standard deviations: one seed in 16000 is out.
double four_deviations(Index samples) { return 4 * 0.5 * std::sqrt(2 * 3.17 / static_cast<double>(samples)); }

constexpr Index length = 3000;
constexpr double sigma = 0.03;

TEST(NoiseLevel, OfWhiteNoiseIsItsStandardDeviation) {
  for (unsigned seed = 1; seed <= 5; ++seed)
    for (const int order : {1, 3, 6})
      EXPECT_NEAR(noise_level(white_noise(length, sigma, seed), order) / sigma, 1, four_deviations(length)) << "seed " << seed << ", order " << order;
}

TEST(NoiseLevel, DoesNotSeeASlowSignal) {
  // 10 Hz at 500 Hz: the sixth difference passes (2 sin(pi / 50))^6 = 4e-6 of the amplitude, 0.004 sigma.
  VectorXd x = white_noise(length, sigma, 11);
  for (Index k = 0; k < length; ++k) x[k] += 1000 * sigma * std::sin(2 * pi * 10 * 0.002 * static_cast<double>(k)) + 0.1 * static_cast<double>(k);
  EXPECT_NEAR(noise_level(x) / sigma, 1, four_deviations(length));
}

TEST(NoiseLevel, LeavesOutWhatIsMissing) {
  VectorXd x = white_noise(length, sigma, 12);
  for (Index k = 5; k < length; k += 40) x[k] = nan;
  EXPECT_NEAR(noise_level(x) / sigma, 1, four_deviations(length * 33 / 40));  // each gap takes seven differences of forty
}

TEST(NoiseLevel, WithstandsSpikesAndSteps) {
  VectorXd x = white_noise(length, sigma, 13);
  for (Index k = 50; k < length; k += 100) x[k] += 100 * sigma;
  x.tail(length / 2).array() += 1000 * sigma;
  // 7 % of the differences hold a spike. That lifts the median by 9 %; and two of each seven, where the spike weighs 1 in sqrt(924), are 3.3 sigma
  // and pass the cut at 3.5 medians: 2 % of 11 sigma^2, 10 % in the level.
  const double level = noise_level(x) / sigma;
  EXPECT_GT(level, 1 - four_deviations(length));
  EXPECT_LT(level, 1.1 + four_deviations(length));
}

TEST(NoiseLevel, CountsTailsThatComeAllOverTheRecord) {
  std::mt19937_64 random(15);
  std::student_t_distribution<double> student(3);
  VectorXd x(length);
  for (double& value : x)
    do value = sigma * student(random);
    while (std::abs(value) > 10 * sigma);  // what is further out is no reading (core/run/bad_readings.h)
  const double spread = x.norm() / std::sqrt(static_cast<double>(length));
  // A cut at 3.5 makes the levels 8, 6 and 3 % too small, measured; of the differences' own scatter (four_deviations, which is of order 6) 1.4 % were seen.
  for (const int order : {1, 3, 6}) EXPECT_NEAR(noise_level(x, order) / spread, 1, 0.02) << order;
}

TEST(NoiseLevel, DoesNotCountATransient) {
  VectorXd x = white_noise(length, sigma, 16);
  for (Index k = 0; k < 60; ++k) x[k] += 5 * sigma * (k % 2 == 0 ? 1 : -1);
  EXPECT_NEAR(noise_level(x) / sigma, 1, 0.01 + four_deviations(length));
}

TEST(NoiseLevel, OfACoarseConverterIsItsQuantum) {
  const double quantum = 0.25;
  VectorXd x(length);
  for (Index k = 0; k < length; ++k) x[k] = quantum * std::round(20 * std::sin(2 * pi * 0.3 * 0.002 * static_cast<double>(k)) / quantum);
  EXPECT_NEAR(noise_level(x), quantum / std::sqrt(12.0), 1e-12);
}

TEST(NoiseLevel, OfAConstantIsZero) {
  EXPECT_LT(noise_level(VectorXd::Constant(100, 3.7)), 1e-15);  // sums of 3.7 round
  EXPECT_EQ(rounding_level(VectorXd::Constant(100, 3.7)), 0);
}

TEST(NoiseLevel, AFastSignalIsNoCoarseConverter) {
  // At a hundred samples per period and 3000 sigma hardly any change is as small as the noise.
  VectorXd x = white_noise(length, sigma, 14);
  for (Index k = 0; k < length; ++k) x[k] += 3000 * sigma * std::sin(2 * pi * 0.01 * static_cast<double>(k));
  EXPECT_EQ(rounding_level(x), 0);
  EXPECT_NEAR(noise_level(x) / sigma, 1, four_deviations(length));
}

TEST(RoundingLevel, SeesTheQuantumUnderSparseDecimals) {
  // 1.5708e-4 rad printed to 1e-7: changes of 0.0001570 and 0.0001571.
  VectorXd x(length);
  for (Index k = 0; k < length; ++k) {
    const double counts = std::round(40 * std::sin(2 * pi * 0.001 * static_cast<double>(k)));
    x[k] = std::round(counts * 1.5708e-4 * 1e7) / 1e7;
  }
  EXPECT_NEAR(rounding_level(x) / (1.5708e-4 / std::sqrt(12.0)), 1, 1e-3);
}

// ---------------------------------------------------------------------------------------------------------------- spikes and motion

TEST(IsolatedSpikes, AreFoundAndNothingElse) {
  VectorXd x = white_noise(length, sigma, 21);
  std::vector<Index> planted;
  for (Index k = 100; k < length - 100; k += 397) {
    x[k] += (k % 2 == 0 ? 15 : -15) * sigma;
    planted.push_back(k);
  }
  x[500] = nan;
  const std::vector<bool> spike = isolated_spikes(x, sigma, {{1200, 1300}});
  for (Index k = 0; k < length; ++k) {
    const bool is_planted = std::find(planted.begin(), planted.end(), k) != planted.end();  // the one at 1291 where the shaft is said to move
    EXPECT_EQ(spike[static_cast<std::size_t>(k)], is_planted) << k;
  }
}

/// A smooth ramp of `height` over `rise` samples from `at` on.
void add_ramp(VectorXd& x, Index at, Index rise, double height) {
  for (Index k = at; k < x.size(); ++k) {
    const double s = std::min(1.0, static_cast<double>(k - at) / static_cast<double>(rise));
    x[k] += height * s * s * (3 - 2 * s);
  }
}

TEST(IsolatedSpikes, AreToldFromTheMotionTheyStandIn) {
  // 1.3 deg in 6 to 17 samples: the cubic through four neighbours is off by up to 0.03 deg of it, three standard deviations.
  for (const Index rise : {6, 17}) {
    for (Index at = 495; at < 505 + rise; ++at) {
      VectorXd angle = VectorXd::Constant(length, 2.09) + white_noise(length, 0.01, 51);
      add_ramp(angle, 500, rise, 1.3);
      const std::vector<bool> clean = isolated_spikes(angle, 0.01, {{480, 540}});
      EXPECT_EQ(std::count(clean.begin(), clean.end(), true), 0) << "rise " << rise;
      angle[at] += 0.4;
      const std::vector<bool> spike = isolated_spikes(angle, 0.01, {{480, 540}});
      EXPECT_TRUE(spike[static_cast<std::size_t>(at)]) << "rise " << rise << ", at " << at;
      EXPECT_EQ(std::count(spike.begin(), spike.end(), true), 1) << "rise " << rise << ", at " << at;
    }
  }
}

TEST(Moving, FindsTheRampsOfTheCampaigns) {
  // 1.3 deg in 6 to 17 samples under 0.01 deg of noise, spikes included.
  for (const Index rise : {6, 17}) {
    VectorXd angle = VectorXd::Constant(length, 2.09) + white_noise(length, 0.01, 31);
    add_ramp(angle, 500, rise, 1.3);
    add_ramp(angle, 2000, rise, -0.8);
    angle[200] += 1;
    angle[1500] -= 2;
    const std::vector<Interval> found = moving(angle, 0.01);
    ASSERT_EQ(found.size(), 2u) << "rise " << rise;
    // The median of five, and differences over three samples either way, widen a motion by five samples at most.
    EXPECT_GE(found[0].first, 495);
    EXPECT_LE(found[0].first, 500 + rise / 2);
    EXPECT_GE(found[0].last, 500 + rise / 2);
    EXPECT_LE(found[0].last, 500 + rise + 6);
    EXPECT_NEAR(static_cast<double>(found[1].first + found[1].last) / 2, 2000 + static_cast<double>(rise) / 2, 4);
  }
}

TEST(Moving, FindsNothingInNoiseAndSpikes) {
  for (unsigned seed = 1; seed <= 20; ++seed) {
    VectorXd angle = white_noise(length, 0.01, 100 + seed);
    angle[700] += 5;
    angle[701] -= 3;
    angle[1400] = nan;
    EXPECT_TRUE(moving(angle, 0.01).empty()) << "seed " << seed;
  }
}

TEST(Moving, FindsWhatIsSlow) {
  // Thirty times the noise in 50 to 1000 samples: a change by less than four of it in six samples, which noise alone may look like.
  for (const Index rise : {50, 200, 1000}) {
    VectorXd angle = VectorXd::Constant(2 * length, 2.09) + white_noise(2 * length, 0.01, 51);
    add_ramp(angle, 2500, rise, 0.3);
    angle[1200] = nan;
    const std::vector<Interval> found = moving(angle, 0.01);
    ASSERT_EQ(found.size(), 1u) << "rise " << rise;
    EXPECT_LT(found[0].first, 2500 + rise / 2) << rise;
    EXPECT_GT(found[0].last, 2500 + rise / 2) << rise;
    EXPECT_GT(found[0].first, 2500 - 300) << rise;
    EXPECT_LT(found[0].last, 2500 + rise + 300) << rise;
  }
}

TEST(Moving, TakesNoWanderingForMotion) {
  for (unsigned seed = 1; seed <= 10; ++seed) {
    VectorXd angle = white_noise(10 * length, 0.01, 200 + seed);
    const VectorXd steps = white_noise(10 * length, 0.0005, 300 + seed);
    double walk = 0;
    for (Index k = 0; k < angle.size(); ++k) angle[k] += walk += steps[k] - 0.001 * walk;  // by 0.011, within some thousand samples
    EXPECT_TRUE(moving(angle, 0.01).empty()) << "seed " << seed;
  }
}

/// Swings, together and one by one, that change by less than the noise from sample to sample, and a ramp through most of the record: all of it moves, and nothing stands out.
TEST(Moving, FindsWhatNeverRests) {
  const auto expect_whole = [](const VectorXd& angle, const char* what) {
    const std::vector<Interval> found = moving(angle, 0.01);
    ASSERT_EQ(found.size(), 1u) << what;
    EXPECT_EQ(found[0].first, 0) << what;
    EXPECT_EQ(found[0].last, angle.size()) << what;
  };
  VectorXd several = white_noise(length, 0.01, 61), ramp = white_noise(length, 0.01, 62);
  for (const double period : {400.0, 1500.0}) {
    VectorXd one = white_noise(length, 0.01, 60);
    for (Index k = 0; k < length; ++k) one[k] += 0.4 * std::sin(2 * pi * static_cast<double>(k) / period);
    one[700] = nan;
    one[900] += 1;
    expect_whole(one, "a swing");
    for (Index k = 0; k < length; ++k) several[k] += 0.2 * std::sin(2 * pi * static_cast<double>(k) / period + 1);
  }
  expect_whole(several, "two swings");
  for (Index k = 0; k < length; ++k) ramp[k] += std::clamp(0.002 * static_cast<double>(k - length / 8), 0.0, 0.002 * 0.75 * static_cast<double>(length));
  expect_whole(ramp, "a ramp");
}

/// A random walk that goes twenty times as far as the noise over the record, and noise of equal power in every octave.
TEST(Moving, TakesNoLargeWanderingForMotion) {
  for (unsigned seed = 1; seed <= 10; ++seed) {
    const VectorXd steps = white_noise(4 * length, 0.002, 400 + seed);
    VectorXd walk = white_noise(4 * length, 0.01, 500 + seed), octaves = white_noise(4 * length, 0.01, 600 + seed);
    double at = 0;
    for (Index k = 0; k < walk.size(); ++k) walk[k] += at += steps[k];
    EXPECT_TRUE(moving(walk, 0.01).empty()) << "seed " << seed;
    for (double period = 64; period < 8000; period *= 2) {
      const VectorXd fresh = white_noise(4 * length, 0.01, 700 + seed + static_cast<unsigned>(period));
      double part = 0;
      for (Index k = 0; k < octaves.size(); ++k) octaves[k] += part += (fresh[k] * std::sqrt(2 * period) - part) / period;
    }
    EXPECT_TRUE(moving(octaves, noise_level(octaves)).empty()) << "seed " << seed;
  }
}

TEST(Moving, TakesNoSingleCodeOfAConverterForMotion) {
  constexpr double code = 0.05;
  VectorXd angle = VectorXd::Constant(4 * length, 40 * code);
  for (const Index k : {3000, 3900, 9000}) angle.tail(angle.size() - k).array() += k == 3900 ? -code : code;
  for (const Index k : {100, 5000, 7000, 7003}) angle[k] += code;
  angle.segment(6000, 40).array() += 20 * code;
  const std::vector<Interval> found = moving(angle, code / std::sqrt(12.0));
  ASSERT_EQ(found.size(), 2u) << "up and down by twenty codes";
  EXPECT_NEAR(static_cast<double>(found[0].first), 6000, 10);
  EXPECT_NEAR(static_cast<double>(found[1].last), 6040, 10);
}

TEST(Moving, JoinsWhatNearlyTouches) {
  VectorXd angle = white_noise(length, 0.01, 41);
  add_ramp(angle, 1000, 8, 1);
  add_ramp(angle, 1020, 8, 1);
  EXPECT_EQ(moving(angle, 0.01).size(), 1u);
}

}  // namespace
}  // namespace unrig
