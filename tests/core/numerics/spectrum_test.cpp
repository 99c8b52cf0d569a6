#include "core/numerics/spectrum.h"

#include <gtest/gtest.h>

#include <cmath>
#include <complex>
#include <limits>
#include <numbers>
#include <random>

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::VectorXcd;
using Eigen::VectorXd;
using std::numbers::pi;

VectorXd noise(Index n, unsigned seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  return VectorXd::NullaryExpr(n, [&](Index) { return normal(random); });
}

VectorXd tone(Index n, double dt, double amplitude, double hertz, double phase) {
  return VectorXd::NullaryExpr(n, [&](Index j) { return amplitude * std::cos(2 * pi * hertz * dt * static_cast<double>(j) + phase); });
}

class Lengths : public testing::TestWithParam<Index> {};
INSTANTIATE_TEST_SUITE_P(OddEvenPrimeAndSmall, Lengths, testing::Values(1, 2, 3, 4, 5, 64, 97, 100, 101, 2500, 2503));

TEST_P(Lengths, AgreesWithTheDefinition) {
  const Index n = GetParam();
  const VectorXd x = noise(n, 1);
  const VectorXcd f = fourier(x);
  ASSERT_EQ(f.size(), n / 2 + 1);
  for (Index k = 0; k < f.size(); k += std::max<Index>(1, n / 20)) {
    std::complex<double> sum = 0;
    for (Index j = 0; j < n; ++j) sum += x[j] * std::polar(1.0, -2 * pi * static_cast<double>((j * k) % n) / static_cast<double>(n));
    // Round-off of the plain sum on the right: n terms of order 1.
    EXPECT_NEAR(std::abs(f[k] - sum), 0, 1e-14 * static_cast<double>(n)) << "line " << k;
  }
}

TEST_P(Lengths, KeepsTheMeanSquare) {  // Parseval
  const Index n = GetParam();
  const VectorXd x = noise(n, 2);
  const Spectrum s = amplitude_spectrum(x, 0.01, Window::rectangular);
  double sum = 0;
  for (Index k = 0; k < s.line.size(); ++k) {
    const bool whole = k == 0 || (n % 2 == 0 && k == n / 2);
    sum += std::norm(s.line[k]) * (whole ? 1 : 0.5);
  }
  const double mean_square = x.squaredNorm() / static_cast<double>(n);
  EXPECT_NEAR(sum, mean_square, 1e-13 * mean_square);
}

class LongLengths : public testing::TestWithParam<Index> {};
INSTANTIATE_TEST_SUITE_P(OddEvenAndPrime, LongLengths, testing::Values(64, 97, 100, 101, 2500, 2503));

TEST_P(LongLengths, ReadsAToneWithItsAmplitudeAndPhase) {
  const Index n = GetParam();
  const double dt = 0.002, phase = 0.7, hertz = 20 / (static_cast<double>(n) * dt);  // on line 20
  for (const Window window : {Window::rectangular, Window::hann}) {
    const Spectrum s = amplitude_spectrum(tone(n, dt, 3, hertz, phase), dt, window);
    EXPECT_NEAR(s.frequency(20), hertz, 1e-12);
    EXPECT_NEAR(std::abs(s.line[20] - std::polar(3.0, phase)), 0, 1e-12);
    EXPECT_NEAR(std::abs(s.line[25]), 0, 1e-12);
  }
}

TEST(Spectrum, ReadsAConstantAndTheNyquistLine) {
  VectorXd x = VectorXd::Constant(100, 2.5);
  for (Index j = 0; j < 100; ++j) x[j] += j % 2 == 0 ? 0.5 : -0.5;
  const Spectrum s = amplitude_spectrum(x, 0.01, Window::rectangular);
  EXPECT_NEAR(s.line[0].real(), 2.5, 1e-14);
  EXPECT_NEAR(s.line[50].real(), 0.5, 1e-14);
  EXPECT_DOUBLE_EQ(s.frequency(50), 50);
}

TEST(Spectrum, PadsWithZeros) {
  const VectorXd x = noise(101, 3);
  VectorXd padded = VectorXd::Zero(256);
  padded.head(101) = x;
  EXPECT_LT((fourier(x, 256) - fourier(padded)).norm(), 1e-12);
  const Spectrum s = amplitude_spectrum(tone(1000, 0.01, 2, 10, 0), 0.01, Window::hann, 4000);
  EXPECT_DOUBLE_EQ(s.spacing, 1 / 40.0);
  EXPECT_NEAR(std::abs(s.line[400]), 2, 1e-6);  // leakage of the line at -10 Hz, 200 lines away: about 200^-3
}

TEST(Spectrum, NoiseGainIsThatOfWhiteNoise) {
  const double sigma = 0.3;
  for (const Window window : {Window::rectangular, Window::hann}) {
    double sum = 0;
    Index count = 0;
    double gain = 0;
    for (unsigned seed = 0; seed < 20; ++seed) {
      const Spectrum s = amplitude_spectrum(sigma * noise(500, 100 + seed), 0.01, window);
      gain = s.noise_gain;
      for (Index k = 2; k < 249; ++k) sum += std::norm(s.line[k]), ++count;
    }
    // 4940 exponential variates (correlated in threes under the Hann window): 1.4 % to 2.5 % standard deviation; three of them.
    EXPECT_NEAR(sum / static_cast<double>(count) / (gain * sigma * sigma), 1, 0.075);
  }
}

TEST(Spectrum, RefusesWhatHasNoTransform) {
  EXPECT_THROW(fourier(VectorXd()), std::invalid_argument);
  EXPECT_THROW(fourier(VectorXd::Zero(10), 9), std::invalid_argument);
  VectorXd x = VectorXd::Zero(10);
  x[3] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(fourier(x), std::invalid_argument);
  EXPECT_THROW(amplitude_spectrum(VectorXd::Zero(10), 0), std::invalid_argument);
}

TEST(NoiseFloor, IsTheMeanPowerOfNoiseAndIgnoresPeaks) {
  VectorXd power = fourier(noise(8192, 5)).cwiseAbs2();
  for (Index k = 100; k < power.size(); k += 100) power[k] = 1e9;
  const VectorXd floor = noise_floor(power, 200);
  // The median of 401 exponential variates scatters by 1/sqrt(401)/ln 2 = 7 %; 1 % of the lines are peaks, which lifts it by 1.5 %.
  for (Index k = 0; k < floor.size(); k += 50) EXPECT_NEAR(floor[k] / 8192, 1, k < 200 || k > 3896 ? 0.5 : 0.3) << k;
}

TEST(NoiseFloor, OfAHandfulOfLines) {
  VectorXd power(5);
  power << 1, 5, 2, 4, 3;
  const VectorXd floor = noise_floor(power, 1) * std::numbers::ln2;
  VectorXd median(5);
  median << 3, 2, 4, 3, 3.5;
  EXPECT_LT((floor - median).norm(), 1e-14);
  EXPECT_LT((noise_floor(power, 0) * std::numbers::ln2 - power).norm(), 1e-14);
  EXPECT_LT((noise_floor(power, 99) * std::numbers::ln2 - VectorXd::Constant(5, 3)).norm(), 1e-14);
}

TEST(Peaks, FindsTonesAboveTheFloorAndNothingElse) {
  const Index n = 2000;
  const double dt = 0.005;
  const VectorXd x = tone(n, dt, 1, 7.33, 0.4) + tone(n, dt, 0.05, 31.01, 1) + 0.02 * noise(n, 7);
  const Spectrum s = amplitude_spectrum(x, dt);
  const VectorXd power = s.line.cwiseAbs2();
  const auto found = peaks_above(power, noise_floor(power, 100), 20);  // one false alarm in 5e5 lines
  ASSERT_EQ(found.size(), 2u);
  // Parabola through logarithms under a Hann window: at most 0.06 lines off (maximum over the position between two lines), plus noise.
  EXPECT_NEAR(found[0].position * s.spacing, 7.33, 0.06 * s.spacing);
  EXPECT_NEAR(found[1].position * s.spacing, 31.01, 0.1 * s.spacing);
}

TEST(Peaks, OfPureNoiseAreRare) {
  int alarms = 0;
  for (unsigned seed = 0; seed < 40; ++seed) {
    const VectorXd power = fourier(noise(2000, 200 + seed)).cwiseAbs2();
    alarms += static_cast<int>(peaks_above(power, VectorXd::Constant(power.size(), 2000), 12).size());
  }
  EXPECT_LE(alarms, 3);  // 40 000 lines, each above with exp(-12): 0.25 expected
}

}  // namespace
}  // namespace unrig
