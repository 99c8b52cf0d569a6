// Modes out of frequency response functions whose noise is that of their coherence: values within errors, errors of the right size, as many modes as there are.

#include "core/modal_test/modal_fit.h"

#include <gtest/gtest.h>

#include <cmath>
#include <complex>
#include <numbers>
#include <random>

namespace unrig {
namespace {

using Eigen::Index;
using std::numbers::pi;

struct Truth {
  double frequency, damping_ratio, mass, gain;
};
const std::vector<Truth> truth{{18.3, 0.006, 2.1, 27800}, {64, 0.01, 1.4, 50000}, {71, 0.008, 3.2, -20000}};
constexpr int averages = 5;

/// An accelerometer where the hammer strikes, and a gauge, with modes outside of the band.
std::vector<FrequencyResponse> measured(unsigned seed, bool noisy) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  constexpr Index lines = 1200;
  std::vector<FrequencyResponse> functions(2);
  functions[0].response = Measured::acceleration;
  functions[0].driving_point = functions[0].has_nodes = true;
  for (FrequencyResponse& f : functions) {
    f.frequency = Eigen::VectorXd::LinSpaced(lines, 4, 124);
    f.value.resize(lines);
    f.coherence.resize(lines);
    const double floor = f.response == Measured::acceleration ? 0.01 : 0.02;  // m/s^2/N; N/N
    for (Index k = 0; k < lines; ++k) {
      const double w = 2 * pi * f.frequency[k];
      const bool acceleration = f.response == Measured::acceleration;
      std::complex<double> h = acceleration ? std::complex<double>(2e-7 - 1e-2 / (w * w)) : 0.02;
      for (const Truth& t : truth) {
        const double wk = 2 * pi * t.frequency;
        h += (acceleration ? 1 : t.gain) / t.mass / std::complex<double>(wk * wk - w * w, 2 * t.damping_ratio * wk * w);
      }
      if (acceleration) h *= -w * w;
      const double lost = 0.002 + 0.05 * std::pow(std::sin(0.01 * static_cast<double>(k)), 2);
      f.coherence[k] = 1 - lost;
      f.value[k] = h;
      if (!noisy) continue;
      // As an analyser has it: H and coherence out of the same blows, of one newton each. The noise does not vanish with h, where the coherence does.
      const double sigma = std::hypot(std::abs(h) * std::sqrt(lost / (1 - lost)), floor) / std::sqrt(2);
      std::complex<double> sum = 0;
      double power = 0;
      for (int blow = 0; blow < averages; ++blow) {
        const std::complex<double> x = h + sigma * std::complex<double>(normal(random), normal(random));
        sum += x;
        power += std::norm(x);
      }
      f.value[k] = sum / static_cast<double>(averages);
      f.coherence[k] = std::norm(sum) / (averages * power);
    }
  }
  return functions;
}

TEST(ModalFit, IsExactWithoutNoise) {
  const ModalFit fit = fit_modes(measured(1, false), {3, 0});
  ASSERT_EQ(fit.modes.size(), 3u);
  for (std::size_t k = 0; k < 3; ++k) {
    EXPECT_NEAR(fit.modes[k].frequency / truth[k].frequency, 1, 1e-8);
    EXPECT_NEAR(fit.modes[k].damping_ratio / truth[k].damping_ratio, 1, 1e-6);
    EXPECT_NEAR(fit.modes[k].residue[0] * truth[k].mass, 1, 1e-6);
    EXPECT_NEAR(fit.modes[k].residue[1] / truth[k].gain * truth[k].mass, 1, 1e-6);
  }
}

TEST(ModalFit, SaysHowLargeItsErrorsAre) {
  constexpr unsigned tests = 8;
  double sum = 0, chi2 = 0;
  int count = 0;
  for (unsigned seed = 1; seed <= tests; ++seed) {
    const ModalFit fit = fit_modes(measured(seed, true), {0, averages});
    ASSERT_EQ(fit.modes.size(), 3u) << "of seed " << seed;
    chi2 += fit.reduced_chi2 / tests;
    for (std::size_t k = 0; k < 3; ++k) {
      const double found[] = {fit.modes[k].frequency, fit.modes[k].damping_ratio, fit.modes[k].residue[0], fit.modes[k].residue[1]};
      const double wanted[] = {truth[k].frequency, truth[k].damping_ratio, 1 / truth[k].mass, truth[k].gain / truth[k].mass};
      for (Index i = 0; i < 4; ++i) {
        const double pull = (found[i] - wanted[i]) / std::sqrt(fit.covariance(fit.place(k) + i, fit.place(k) + i));
        EXPECT_LT(std::abs(pull), 4.5) << "seed " << seed << ", mode " << k + 1 << ", value " << i;
        sum += pull * pull;
        ++count;
      }
    }
  }
  // 96 pulls: their mean square is 1 within 4 sqrt(2/96).
  EXPECT_NEAR(sum / count, 1, 4 * std::sqrt(2.0 / count));
  // A line's variance has 2 (n - 1) degrees of freedom times five lines: the mean of what is left over it is 40/38. Its own scatter: 2/40 of each of 240 five lines, twice.
  EXPECT_NEAR(chi2, 40.0 / 38, 4 * std::sqrt(2.0 / (tests * 4800) + 2.0 / (40.0 * tests * 480)));
}

TEST(ModalFit, WithoutACoherenceTheErrorsFollowWhatIsLeft) {
  std::mt19937_64 random(3);
  std::normal_distribution<double> normal;
  std::vector<FrequencyResponse> functions = measured(1, false);
  for (FrequencyResponse& f : functions) {
    f.coherence.resize(0);
    const double sigma = 0.01 * f.value.cwiseAbs().mean();
    for (Index k = 0; k < f.value.size(); ++k) f.value[k] += sigma * std::complex<double>(normal(random), normal(random));
  }
  const ModalFit fit = fit_modes(functions, {});
  ASSERT_EQ(fit.modes.size(), 3u);
  EXPECT_EQ(fit.reduced_chi2, 0) << "not known";
  for (std::size_t k = 0; k < 3; ++k) EXPECT_LT(std::abs(fit.modes[k].frequency - truth[k].frequency), 4.5 * std::sqrt(fit.covariance(fit.place(k), fit.place(k))));
}

/// A mode above the band is no mode of the rig, and makes none: with a constant in its place broad ones filled the gap, of which one had a negative mass.
TEST(ModalFit, AModeJustOutsideOfTheBandIsLeftOut) {
  std::vector<FrequencyResponse> functions = measured(2, true);
  for (FrequencyResponse& f : functions)
    for (Index k = 0; k < f.value.size(); ++k) {
      const double w = 2 * pi * f.frequency[k], wk = 2 * pi * 190;
      const std::complex<double> beyond = 1.0 / 0.7 / std::complex<double>(wk * wk - w * w, 2 * 0.01 * wk * w);
      f.value[k] += f.response == Measured::acceleration ? -w * w * beyond : 3e4 * beyond;
    }
  const ModalFit fit = fit_modes(functions, {0, averages});
  ASSERT_EQ(fit.modes.size(), 3u);
  EXPECT_GE(fit.outside, 1);
  for (std::size_t k = 0; k < 3; ++k) {
    const double found[] = {fit.modes[k].frequency, fit.modes[k].damping_ratio, fit.modes[k].residue[0]}, wanted[] = {truth[k].frequency, truth[k].damping_ratio, 1 / truth[k].mass};
    for (Index i = 0; i < 3; ++i) EXPECT_LT(std::abs(found[i] - wanted[i]), 4.5 * std::sqrt(fit.covariance(fit.place(k) + i, fit.place(k) + i))) << k << ' ' << i;
  }
}

TEST(ModalFit, FindsNoModeWhereThereIsNone) {
  std::vector<FrequencyResponse> functions = measured(1, false);
  for (FrequencyResponse& f : functions)
    for (Index k = 0; k < f.value.size(); ++k) f.value[k] = f.response == Measured::acceleration ? -1e-3 * std::pow(2 * pi * f.frequency[k], 2) : 3.0;
  EXPECT_THROW(fit_modes(functions, {}), NoAnswer);
}

}  // namespace
}  // namespace unrig
