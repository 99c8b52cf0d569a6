// Numbers that the seed prints by the way: Eq. 1.1, the steady coefficient, the frequencies in water, and small sums.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>

#include "core/model/rigid_system.h"
#include "tests/verification/seed.h"

namespace unrig::seed {
namespace {

using Eigen::Index;
using Eigen::VectorXd;
using std::numbers::pi;

double hertz(double reduced) { return reduced / (2 * pi * semichord_time); }

// ------------------------------------------------------------------------------------------------ Eq. 1.1

class RigidStep : public testing::Test {
 protected:
  RigidStep()
      : model_(seed::model(rig(), 1, 1, wagner(Wagner::jones))),
        step_(ideal_step(rigid_system(model_, towed(), undamped(model_)), ideal_amplitude)) {}

  AeroelasticModel model_;
  IdealStep step_;
};

TEST_F(RigidStep, HasEquationOnePointOnesGeneralisedFunctions) {
  // pi (delta + delta'/2) per radian, in semichords: delta(t) = delta(t*) U/b. The circulation adds 2 pi phi(0) delta = pi delta of its
  // own, for the downwash b p' of the pitch rate at the three-quarter chord jumps as a delta function; Eq. 3.10 has it in the p'' under its
  // integral, Eq. 1.1 has not.
  const double T = semichord_time, circulatory = coefficient(step_.output.impulse[0]) / T, total = coefficient(step_.output.impulse[1]) / T;
  EXPECT_NEAR(coefficient(step_.output.doublet[1]) / (T * T) / ideal_amplitude, pi / 2, 1e-12);
  EXPECT_NEAR((total - circulatory) / ideal_amplitude, pi, 1e-12);
  EXPECT_NEAR(circulatory / ideal_amplitude, 2 * pi * 0.5, 1e-12);
}

TEST_F(RigidStep, BuildsUpFasterThanEquationOnePointOneSays) {
  // For rotation about the quarter chord w = U (p + p'), so that C_N(t) = 2 pi (phi + phi'), where Eq. 1.1 writes 2 pi phi alone: 10.8 % of
  // the final value too little at once with Jones' poles (12.5 % with Wagner's function itself, phi'(0) = 1/8), 1 % after 8 semichords.
  const IndicialFunction phi = wagner(Wagner::jones);
  const auto rate = [&](double s) { return (phi.amplitude.array() * phi.rate.array() * (-phi.rate.array() * s).exp()).sum(); };
  for (const double s : {0.0, 0.5, 1.0, 3.0, 10.0}) {
    const double cn = coefficient(step_.output_at(s * semichord_time)[1]) / (2 * pi * ideal_amplitude);
    EXPECT_NEAR(cn, phi(s) + rate(s), 1e-12) << s << " semichords";
  }
  EXPECT_NEAR(rate(0), 0.108, 1e-3);
  EXPECT_LT(rate(8), 0.0145);
}

TEST(EquationOnePointOne, CoefficientsOfThreePlaces) {
  // 0.157 and 0.235 leave 0.608 of the final circulation at once, 0.157 and 0.335 0.508; R. T. Jones's 0.165 and 0.335 leave Wagner's one
  // half.
  EXPECT_NEAR(wagner(Wagner::jones)(0), wagner_exact(0), 1e-12);
  EXPECT_NEAR(1 - 0.157 - 0.335, wagner_exact(0), 0.0081);
  EXPECT_NEAR(1 - 0.157 - 0.235, wagner_exact(0), 0.1081);
}

// ------------------------------------------------------------------------------------------------ steady

TEST(SteadyCoefficient, ComesOutAtTwoDegreesNotAtTwoPointZeroNine) {
  // "C_N0 can be calculated by Equation 2.1 which gives the result of 0.22 for step onset 2.09 deg": Eq. 2.2 gives 0.229. The captions of
  // Figures 4.3 say "step onset angle = 2 deg", and 2 pi sin 2 deg is 0.219.
  EXPECT_NEAR(2 * pi * std::sin(2.09 * degree), 0.2291, 5e-5);
  EXPECT_NEAR(2 * pi * std::sin(2.00 * degree), 0.22, 5e-3);
  EXPECT_GT(2 * pi * std::sin(2.09 * degree), 0.225) << "does not round to 0.22";
}

TEST(SteadyCoefficient, TheGaugeReadsTheForceWhereverTheModesEnd) {
  for (const Index modes : {1, 3}) {
    const AeroelasticModel model = seed::model(rig(), modes, 1, wagner(Wagner::jones));
    const IdealStep step = ideal_step(model.system(towed(), undamped(model), {"gauge"}), 2.09 * degree);
    EXPECT_NEAR(coefficient(step.output.steady[0]), 2 * pi * 2.09 * degree, 1e-12) << "linear: 0.2292, sin alpha is 0.02 % less";
  }
}

// ------------------------------------------------------------------------------------------------ section 4.3

TEST(FrequenciesInWater, FromTheSeedsOwnCoefficients) {
  const Equations e = printed_equations();
  const Eigen::VectorXcd root = roots(solve(e, 1).denominator);
  double slow = 0, fast = 0;
  for (const std::complex<double> r : root) {
    if (r.imag() > 20)
      fast = r.imag();
    else if (r.imag() > 1)
      slow = r.imag();
  }
  // Towed. 2.92 and 63.34 Hz are the rounded roots of section 3.10, 2.29 and 49.75; the roots themselves give 2.91.
  EXPECT_NEAR(hertz(2.29), 2.92, 5e-3);
  EXPECT_NEAR(hertz(49.75), 63.34, 5e-3);
  EXPECT_NEAR(hertz(slow), 2.911, 5e-4);
  EXPECT_NEAR(hertz(fast), 63.34, 5e-3);
  // At rest, where "apparent mass" alone acts: det(K - omega^2 M) = 0.
  const double a = e.m * e.tgg - e.mg * e.tq, b = e.m * e.kt + e.tgg * e.k, c = e.k * e.kt, root_of = std::sqrt(b * b - 4 * a * c);
  EXPECT_NEAR(hertz(std::sqrt((b - root_of) / (2 * a))), 2.904, 5e-4);
  EXPECT_NEAR(hertz(std::sqrt((b + root_of) / (2 * a))), 63.34, 5e-3);
}

TEST(FrequenciesInWater, FromTheRig) {
  const double rho = still_water().density;
  const VectorXd one = coupled_frequencies(rig(), make_basis(rig(), Index{1}, Index{1}), rho);
  EXPECT_NEAR(one[0], 2.92, 0.02) << "2.901";
  EXPECT_NEAR(one[1], 63.34, 0.28) << "63.07: 1.1898 for 1.192 in the coupling and 1.4804 for 1.4752";
}

TEST(FrequenciesInWater, TheTorsionalOneIsNotConverged) {
  // With one normal mode torsion stands at 63 Hz. The second, at 15 Hz, and the third, at 49 Hz, push it to 71 Hz: the water ties heave and
  // pitch together more strongly than the airfoil's own mass. Frequencies to half of their last digit, from an independent calculation.
  const double rho = still_water().density;
  const VectorXd one = coupled_frequencies(rig(), make_basis(rig(), Index{1}, Index{1}), rho);
  const VectorXd all = coupled_frequencies(rig(), make_basis(rig(), Index{15}, Index{1}), rho);
  EXPECT_NEAR(one[1], 63.07, 5e-3);
  const double converged[] = {2.900, 15.074, 49.085, 70.953, 133.27};
  for (Index k = 0; k < 5; ++k) EXPECT_NEAR(all[k], converged[k], 5e-3) << "frequency " << k + 1;
}

TEST(FrequenciesInWater, ConvergeSlowlyInAThinBasis) {
  // By another program: 15.37 Hz with two modes, 15.10 with four; 52.7, 49.5, 49.27 Hz for the third with three, four and five. That rig has
  // the mass centres of elements 13 and 14 on the axis; half of the last digit.
  Rig rig = seed::rig();
  rig.mass_centre[12] = rig.mass_centre[13] = 0;
  const double rho = still_water().density;
  const auto frequency = [&](Index modes, Index k) { return coupled_frequencies(rig, make_basis(rig, modes, Index{1}), rho)[k]; };
  EXPECT_NEAR(frequency(2, 1), 15.37, 5e-3);
  EXPECT_NEAR(frequency(4, 1), 15.10, 5e-3);
  EXPECT_NEAR(frequency(3, 2), 52.7, 0.05);
  EXPECT_NEAR(frequency(4, 2), 49.5, 0.05);
  EXPECT_NEAR(frequency(5, 2), 49.27, 5e-3);
  EXPECT_NEAR(frequency(15, 3), 66.48, 5e-3)
      << "torsion; 70.95 Hz with the airfoil's 1.27 in for both: it hangs on two lengths that are not printed";
}

// ------------------------------------------------------------------------------------------------ small sums

TEST(SmallSums, ReducedRateAndLengths) {
  EXPECT_NEAR(0.1598 * 14, 2.2372, 5e-5) << "mass of an airfoil element, lb";
  EXPECT_NEAR(42.0 / 3 / semichord, 4.667, 5e-4) << "l15 = l16 = l17 'in inches' is in semichords; 14 in";
  const double nu = 0.96e-6;  // m^2/s, water at 22 C
  EXPECT_NEAR(speed * 0.0254 * 2 * semichord * 0.0254 / nu / 95000, 1, 0.03) << "Reynolds number near 95,000";
}

TEST(SmallSums, TheWaterWeighsSixTimesTheAirfoil) {
  // pi rho b^2 against the airfoil's 0.1598 lb/in.
  EXPECT_NEAR(pi * density * semichord * semichord / 0.1598, 6.39, 5e-3);
  const Equations e = printed_equations();
  EXPECT_NEAR((e.lq / 2) / (e.m - e.lq / 2), 6.1, 0.1) << "in the first mode";
}

TEST(SmallSums, ShareOfTheOscillationLeftAfterThreeSemichords) {
  // "Most of the oscillatory response has decayed beyond 3 semichords": 28 % of the slow one is left, 8 % of the fast one.
  EXPECT_NEAR(std::exp(-0.42 * 3), 0.28, 5e-3);
  EXPECT_NEAR(std::exp(-0.825 * 3), 0.08, 5e-3);
}

TEST(SmallSums, AppendixDMergesSineAndCosine) {
  // A sin(w t + phase) with A = hypot(D, E), phase = atan(E/D); three printed digits each.
  EXPECT_NEAR(std::hypot(printed_q.D, printed_q.E), 0.02, 5e-5);
  EXPECT_NEAR(std::atan2(printed_q.E, printed_q.D), 0.481, 1e-3);
  EXPECT_NEAR(std::hypot(printed_q.F, printed_q.G), 0.0155, 5e-5);
  EXPECT_NEAR(std::atan2(-printed_q.G, -printed_q.F), 1.504, 5e-4);
  EXPECT_NEAR(std::hypot(printed_g.D, printed_g.E), 7.5e-5, 5e-7);
  EXPECT_NEAR(std::atan2(-printed_g.E, -printed_g.D), 0.823, 5e-4);
  EXPECT_NEAR(std::hypot(printed_g.F, printed_g.G), 0.024, 5e-5);
  // Only g's first constant has a sign and a digit of its own there: "0.000000133", "-1.13E-7/(s+.29)" for -1.33E-7.
}

}  // namespace
}  // namespace unrig::seed
