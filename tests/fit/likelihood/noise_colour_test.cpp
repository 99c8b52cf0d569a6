#include "fit/likelihood/noise_colour.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <Eigen/QR>
#include <array>
#include <cmath>
#include <numbers>
#include <random>
#include <vector>

#include "core/numerics/spectrum.h"
#include "core/propagate/response.h"
#include "tests/fit/one_mode.h"

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double dt = 0.002;

NoiseColour three_parts() { return {VectorXd{{0.3, 4, 40}}, VectorXd{{2, 0.5, 0.1}}, 0.7}; }

/// The same behind a filter against aliasing, of which little is white.
NoiseColour behind_a_filter() { return {VectorXd{{0.3, 4}}, VectorXd{{2, 0.5}}, 0.1, VectorXd{{0.4, 0.3, 0.6}}}; }

/// What one sample of white noise leaves in a falling part, sample by sample: 1, 1 + b, b (1 + b), ...
std::vector<double> answer_of_falling(std::size_t which, std::size_t steps) {
  const double tangent = std::tan(std::numbers::pi * std::array{0.25, 0.375, 0.45}.at(which)), b = (1 - tangent) / (1 + tangent);
  std::vector<double> answer{1};
  for (double next = 1 + b; answer.size() < steps; next *= b) answer.push_back(next);
  return answer;
}

/// Sums of independent processes, sample by sample: nothing of the filter is in it.
VectorXd noise_of(const NoiseColour& colour, Index samples, unsigned seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  VectorXd noise = VectorXd::NullaryExpr(samples, [&] { return std::sqrt(colour.white) * normal(random); });
  for (Index i = 0; i < colour.corner.size(); ++i) {
    const double pole = std::exp(-2 * std::numbers::pi * colour.corner[i] * dt), size = std::sqrt(colour.power[i]);
    double part = size * normal(random);
    for (Index k = 0; k < samples; ++k) {
      noise[k] += part;
      part = pole * part + size * std::sqrt(1 - pole * pole) * normal(random);
    }
  }
  for (Index i = 0; i < colour.falling.size(); ++i) {
    constexpr Index before = 60;  // what b has to that power is none
    const std::vector<double> answer = answer_of_falling(static_cast<std::size_t>(i), before);
    double power = 0;
    for (const double a : answer) power += a * a;
    const VectorXd u = VectorXd::NullaryExpr(samples + before, [&] { return normal(random); });
    for (Index k = 0; k < samples; ++k)
      for (Index j = 0; j < before; ++j) noise[k] += std::sqrt(colour.falling[i] / power) * answer[static_cast<std::size_t>(j)] * u[k + before - j];
  }
  return noise;
}

MatrixXd covariance_of(const NoiseColour& colour, Index samples) {
  MatrixXd covariance = colour.white * MatrixXd::Identity(samples, samples);
  for (Index i = 0; i < colour.corner.size(); ++i)
    for (Index a = 0; a < samples; ++a)
      for (Index b = 0; b < samples; ++b) covariance(a, b) += colour.power[i] * std::exp(-2 * std::numbers::pi * colour.corner[i] * dt * std::abs(static_cast<double>(a - b)));
  for (Index i = 0; i < colour.falling.size(); ++i) {
    const std::vector<double> answer = answer_of_falling(static_cast<std::size_t>(i), static_cast<std::size_t>(2 * samples));
    VectorXd at_lag = VectorXd::Zero(samples);
    for (Index lag = 0; lag < samples; ++lag)
      for (std::size_t j = 0; j + static_cast<std::size_t>(lag) < answer.size(); ++j) at_lag[lag] += answer[j] * answer[j + static_cast<std::size_t>(lag)];
    for (Index a = 0; a < samples; ++a)
      for (Index b = 0; b < samples; ++b) covariance(a, b) += colour.falling[i] * at_lag[std::abs(a - b)] / at_lag[0];
  }
  return covariance;
}

class WhiteningFilterOf : public testing::TestWithParam<NoiseColour> {};

/// Behind the filter, with the noise's own start where its prior and the readings put it: chi-square and determinant are those of the whole covariance.
TEST_P(WhiteningFilterOf, SaysWhatTheWholeCovarianceSays) {
  const NoiseColour colour = GetParam();
  const WhiteningFilter filter(colour, dt);
  constexpr Index n = 300;
  const MatrixXd covariance = covariance_of(colour, n);
  const Eigen::LLT<MatrixXd> root(covariance);
  LinearSystem system;  // one state that is read and does nothing
  system.A = system.B = system.C = system.D = DualMatrix(MatrixXd::Zero(1, 1));
  system.B = DualMatrix(MatrixXd(1, 0)), system.D = DualMatrix(MatrixXd(1, 0));
  ExactStep step{dt, DualMatrix(MatrixXd::Zero(1, 1)), {}, DualMatrix(MatrixXd(1, 0)), DualMatrix(MatrixXd(1, 0)), {}};
  filter.append(0, system, step);
  const MatrixXd from_start = free_response_rows(system, step, n).front().rightCols(filter.states());
  for (const unsigned seed : {1u, 2u, 3u}) {
    const VectorXd y = noise_of(colour, n, seed).array() + 3;  // an offset that the filter starts settled to
    // Difference between the filter's state and the noise's own is u: white = filtered(y) - response(u), and the noise's start is settled (y_0 - 0) - u.
    MatrixXd rows(n + filter.states(), filter.states());
    rows << from_start / filter.sigma(), filter.start_information();
    VectorXd right(n + filter.states());
    right << filter.filtered(y) / filter.sigma(), filter.start_information() * filter.settled() * y[0];
    const VectorXd u = rows.colPivHouseholderQr().solve(right);
    const double chi2 = (right - rows * u).squaredNorm();
    // The filter's gain is steady to 1e-13, and the start's covariance is cut at 1e-10 of its largest.
    EXPECT_NEAR(chi2, root.matrixL().solve(y).squaredNorm(), 1e-6 * chi2);
    // -2 log of the density: n log s^2, the start's prior, and what the readings say of the start.
    const double determinant = 2 * static_cast<double>(n) * std::log(filter.sigma() / filter.gain()) - 2 * filter.log_start_information() + std::log((rows.transpose() * rows).determinant());
    EXPECT_NEAR(determinant, 2 * MatrixXd(root.matrixL()).diagonal().array().log().sum(), 1e-5);
  }
}

TEST_P(WhiteningFilterOf, LeavesAConstantAlone) {
  const WhiteningFilter filter(GetParam(), dt);
  EXPECT_LT((filter.filtered(VectorXd::Constant(50, 2.5)).array() - 2.5).abs().maxCoeff(), 1e-10);
}

TEST_P(WhiteningFilterOf, ItsDensityIsTheMeanPeriodogramAndHoldsTheVariance) {
  const NoiseColour colour = GetParam();
  constexpr Index lines = 1 << 17;  // spaced by a hundredth of the lowest corner
  const double spacing = 0.5 / dt / lines;
  double sum = 0;
  for (Index k = 0; k < lines; ++k) sum += colour.density((static_cast<double>(k) + 0.5) * spacing, dt) * spacing;
  EXPECT_NEAR(sum, colour.variance(), 1e-6);
  constexpr Index samples = 4096;
  const int records = 400;
  VectorXd power = VectorXd::Zero(samples / 2 + 1);
  for (unsigned seed = 1; seed <= records; ++seed) power += 2 * dt / static_cast<double>(samples) * fourier(noise_of(colour, samples, seed)).cwiseAbs2() / records;
  for (const Index k : {100, 300, 1000, 2000}) {  // far from the lowest line, where an end of the record leaks; 11 lines of 400 records: 1.5 %
    const double mean = power.segment(k - 5, 11).mean();
    EXPECT_NEAR(mean / colour.density(static_cast<double>(k) / (samples * dt), dt), 1, 0.06) << k;
  }
}

INSTANTIATE_TEST_SUITE_P(Colours, WhiteningFilterOf, testing::Values(three_parts(), behind_a_filter()));

/// White noise is called coloured once in a thousand, and the likelihood of powers that may not be negative is less than the threshold's chi-square.
TEST(NoiseColour, IsSeldomSeenInWhiteNoise) {
  constexpr unsigned trials = 500;
  int seen = 0;
  for (unsigned seed = 0; seed < trials; ++seed) seen += colour_of({{noise_of({VectorXd(0), VectorXd(0), 0.04}, 2000, seed), dt}}) ? 1 : 0;
  EXPECT_LE(seen, 3);
}

/// Variances over bands of frequency, which the record determines, where single parts trade with each other.
TEST(NoiseColour, IsFoundWithItsSize) {
  const NoiseColour truth{VectorXd{{0.8, 9}}, VectorXd{{0.3, 0.2}}, 0.5};
  const auto spectrum = [](const NoiseColour& c, double f) {
    double sum = c.white;
    for (Index i = 0; i < c.corner.size(); ++i) {
      const double a = std::exp(-2 * std::numbers::pi * c.corner[i] * dt);
      sum += c.power[i] * (1 - a * a) / (1 - 2 * a * std::cos(2 * std::numbers::pi * f * dt) + a * a);
    }
    return sum;
  };
  for (const unsigned seed : {1u, 2u, 3u, 4u, 5u}) {
    VectorXd one = noise_of(truth, 6000, seed), other = noise_of(truth, 3000, seed + 100);
    one.segment(2000, 300).setConstant(std::nan(""));  // the shaft moves
    const std::optional<NoiseColour> found = colour_of({{one, dt}, {other, dt}});
    ASSERT_TRUE(found) << seed;
    // Below 1 Hz some ten lines tell it, each to 100 %: 30 %.
    for (const double f : {0.5, 2.0, 10.0, 50.0, 200.0}) EXPECT_NEAR(std::log(spectrum(*found, f) / spectrum(truth, f)), 0, 0.5) << seed << " at " << f << " Hz";
    EXPECT_NEAR(std::log(spectrum(*found, 200) / spectrum(truth, 200)), 0, 0.08) << "thousands of lines";
  }
}

/// 1/f noise has no lowest frequency. The mean of a record's first sixth says less of that of its second half than parts do that a record tells from a constant.
TEST(NoiseColour, OfOneOverFGoesOnBelowTheRecord) {
  constexpr Index samples = 2000, first = samples / 6, last = samples / 2;
  constexpr unsigned trials = 60, runs = 5;
  NoiseColour truth{VectorXd(36), VectorXd::Constant(36, 1.0 / 36), 0.3};
  for (Index i = 0; i < 36; ++i) truth.corner[i] = 0.5 / dt / std::pow(10, static_cast<double>(i) / 8);  // eight to a decade, down to a thousandth of a hertz
  VectorXd weight = VectorXd::Zero(samples);
  weight.head(first).setConstant(-1.0 / first);
  weight.tail(last).setConstant(1.0 / last);
  VectorXd in_common(samples);  // of the weights, lag by lag
  for (Index lag = 0; lag < samples; ++lag) in_common[lag] = weight.head(samples - lag).dot(weight.tail(samples - lag));
  const auto expected = [&](const NoiseColour& colour) {
    double sum = colour.white * in_common[0];
    for (Index i = 0; i < colour.corner.size(); ++i) {
      const double pole = std::exp(-2 * std::numbers::pi * colour.corner[i] * dt);
      double correlation = colour.power[i], part = correlation * in_common[0];
      for (Index lag = 1; lag < samples; ++lag) part += 2 * (correlation *= pole) * in_common[lag];
      sum += part;
    }
    return sum;
  };
  double told = 0;
  unsigned found = 0;
  for (unsigned seed = 0; seed < trials; ++seed) {
    std::vector<RestResidual> residuals;
    for (unsigned r = 0; r < runs; ++r) residuals.push_back({noise_of(truth, samples, 100 * seed + r), dt});
    const std::optional<NoiseColour> colour = colour_of(residuals);
    if (!colour) continue;
    found += 1;
    told += expected(*colour);
  }
  ASSERT_GT(found, trials * 9 / 10);
  const double ratio = told / found / expected(truth);
  EXPECT_GT(ratio, 0.95) << "0.85 with what the records tell alone";
  EXPECT_LT(ratio, 1.25) << "three hundred records tell it to 8 %, in fourfold steps";
}

TEST(NoiseColour, BehindAFilterAgainstAliasingIsFound) {
  constexpr Index samples = 8192, lines = 401;
  for (const unsigned seed : {1u, 2u, 3u, 4u}) {
    const VectorXd noise = one_mode::decimated_noise(samples, seed);
    const std::optional<NoiseColour> found = colour_of({{noise, dt}});
    ASSERT_TRUE(found) << seed;
    ASSERT_GT(found->falling.size(), 0) << seed;
    EXPECT_NEAR(found->variance(), noise.squaredNorm() / samples, 0.03) << seed;
    const VectorXd power = 2 * dt / static_cast<double>(samples) * fourier(noise).cwiseAbs2();
    for (const Index k : {300, 1500, 2500, 3000, 3800})  // 401 lines: 5 %; the fall is steeper than that of any part
      EXPECT_NEAR(power.segment(k - lines / 2, lines).mean() / found->density(static_cast<double>(k) / (samples * dt), dt), 1, 0.2) << seed << " at line " << k;
  }
}

/// What physics leaves is no noise: lines and decays that ring are not taken for a colour.
TEST(NoiseColour, IsNotALineNorARinging) {
  for (const unsigned seed : {1u, 2u, 3u, 4u}) {
    const VectorXd white = noise_of({VectorXd(0), VectorXd(0), 0.04}, 3000, seed);
    VectorXd line = white, ringing = white;
    for (Index k = 0; k < white.size(); ++k) {
      const double t = dt * static_cast<double>(k), w = 2 * std::numbers::pi * 7.3;
      line[k] += 0.1 * std::sin(w * t + seed);
      ringing[k] += 0.6 * std::exp(-0.03 * w * t) * std::cos(w * t);
    }
    EXPECT_FALSE(colour_of({{line, dt}})) << seed;
    EXPECT_FALSE(colour_of({{ringing, dt}})) << seed;
  }
}

/// A mismatch in one run or two of five hides the colour of all, but not that of most.
TEST(NoiseColour, OfMostIsToldBesideAMismatchInOthers) {
  const NoiseColour truth{VectorXd{{5}}, VectorXd{{0.6}}, 0.4};
  for (const unsigned mismatches : {0u, 1u, 2u, 3u}) {
    std::vector<RestResidual> runs;
    for (unsigned r = 0; r < 5; ++r) {
      VectorXd left = noise_of(truth, 3000, 20 + r);
      for (Index k = 0; r < mismatches && k < left.size(); ++k) left[k] += 3 * std::sin(2 * std::numbers::pi * (7 + r) * dt * static_cast<double>(k));
      runs.push_back({left, dt});
    }
    const std::optional<NoiseColour> of_most = colour_of_most(runs);
    EXPECT_EQ(colour_of(runs).has_value(), mismatches == 0) << mismatches;
    EXPECT_EQ(of_most.has_value(), mismatches <= 2) << mismatches;
    if (!of_most) continue;
    EXPECT_NEAR(of_most->variance(), truth.variance(), 0.15 * truth.variance()) << "three runs of 6 s of a corner at 5 Hz tell it to 6 %";
  }
}

TEST(NoiseColour, OfOthersTakesTheSizeThatIsHere) {
  NoiseColour truth = three_parts();
  const std::optional<NoiseColour> here = sized(truth, {3 * noise_of(truth, 20000, 7), dt});
  ASSERT_TRUE(here);
  EXPECT_NEAR(here->white, 9 * truth.white, 0.05 * 9 * truth.white);  // 10 000 lines: 1 %
  EXPECT_NEAR(here->power[2] / here->white, truth.power[2] / truth.white, 1e-9);
  EXPECT_FALSE(sized(truth, {VectorXd::Constant(500, std::nan("")), dt}));
}

}  // namespace
}  // namespace unrig
