// The open question of section 4.2.3: "below 1.0 semichord the experiment data indicate a lower frequency of vibration than the analysis
// ... this frequency may be associated with a higher NDOF mode". A recording by the full-order rig (all 17 normal modes, 1 % and 2 %
// damping) under the seed's step of 1.3 deg, against models of fewer modes: under the same motion with the same parameters, and after a
// fit.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "core/model/rigid_system.h"
#include "core/numerics/spectrum.h"
#include "fit/fit.h"
#include "tests/verification/seed.h"

namespace unrig::seed {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

enum class Judged { by_forces, by_curvature };

VectorXd reading(Index modes, Judged judged) {
  static const SampledMotion step = step_motion();
  const AeroelasticModel model = seed::model(rig_from_drawings(), modes, 1, wagner(Wagner::within_1e4));
  LinearSystem system = model.system(towed(), model.start_values(), {"gauge"});
  if (judged == Judged::by_curvature) {
    const Eigen::RowVectorXd row = curvature_reading(model);
    MatrixXd c = MatrixXd::Zero(1, system.states());
    c.leftCols(row.size()) = row;
    system.C = DualMatrix(c);
    system.D = DualMatrix(MatrixXd::Zero(1, 0));
  }
  return motion_response(system, step.motion, step.dt).col(0);
}

constexpr double dt = 0.0005;
constexpr Index onset = 200, semichord_samples = 250;

/// The spectrum of what a model leaves of the recording, over some semichords after the onset.
struct Left {
  double rms = 0;
  double strongest = 0;   ///< Hz
  double near_15_hz = 0;  ///< amplitude of the strongest line from 12 to 20 Hz
};

Left left(const VectorXd& difference, Index from, Index to) {
  const VectorXd part = difference.segment(onset + from * semichord_samples, (to - from) * semichord_samples);
  const Spectrum spectrum = amplitude_spectrum(part, dt, Window::hann, 16384);
  const VectorXd power = spectrum.line.cwiseAbs2();
  Left result;
  result.rms = part.norm() / std::sqrt(static_cast<double>(part.size()));
  Index strongest = 0;
  power.maxCoeff(&strongest);
  result.strongest = spectrum.frequency(strongest);
  for (Index k = 0; k < power.size(); ++k) {
    const double f = spectrum.frequency(k);
    if (f >= 12 && f <= 20) result.near_15_hz = std::max(result.near_15_hz, std::sqrt(power[k]));
  }
  return result;
}

class OpenQuestion : public testing::Test {
 protected:
  Left of(Index modes, Judged judged, Index from, Index to) const { return left(recording_ - reading(modes, judged), from, to); }
  double recorded(Index from, Index to) const {
    return recording_.segment(onset + from * semichord_samples, (to - from) * semichord_samples).norm() /
           std::sqrt(static_cast<double>((to - from) * semichord_samples));
  }
  VectorXd recording_ = reading(17, Judged::by_forces);
};

TEST_F(OpenQuestion, WhatTheSeedsModelLeavesSitsAtFifteenHertz) {
  // The seed reads the curvature of its one normal mode. The rig's second wet mode is at 15.08 Hz; a line of four semichords, half a
  // second, is 4 Hz wide, of which a tenth locates a peak that stands alone.
  const Left early = of(1, Judged::by_curvature, 0, 4);
  EXPECT_NEAR(early.strongest, 15.08, 0.4);
  EXPECT_GT(early.near_15_hz, 3.0) << "N; 3.14 measured, on a recording of 5.7 N r.m.s.";
  // A period of 0.53 semichords, between those of 2.75 (2.9 Hz) and 0.13 (63 Hz) that the analysis kept: "a lower frequency of vibration".
  EXPECT_NEAR(1 / (15.08 * semichord_time), 0.53, 5e-3);
}

TEST_F(OpenQuestion, ItIsGoneAfterAFewSemichords) {
  const double first = of(1, Judged::by_curvature, 0, 1).near_15_hz, last = of(1, Judged::by_curvature, 8, 12).near_15_hz;
  EXPECT_GT(first, 5.5) << "N; 5.88 measured";
  EXPECT_LT(last, 0.1) << "N; 0.08 measured: the water damps it by 3.4 % of critical";
}

TEST_F(OpenQuestion, OneMoreNormalModeRemovesMostOfIt) {
  for (const Judged judged : {Judged::by_forces, Judged::by_curvature}) {
    const Left one = of(1, judged, 0, 1), two = of(2, judged, 0, 1), three = of(3, judged, 0, 1);
    // Over the first semichord nine tenths (0.11 left), with two more modes all but 2 %; measured, rounded up.
    EXPECT_LT(two.near_15_hz / one.near_15_hz, 0.12);
    EXPECT_LT(three.near_15_hz / one.near_15_hz, 0.02);
    EXPECT_LT(two.rms / one.rms, 0.2);
  }
}

TEST_F(OpenQuestion, ItsFrequencyIsOffByTwoPercentSoItDriftsApart) {
  // Two modes give 15.35 Hz for 15.08: four semichords later they are an eighth of a cycle apart, and the second mode takes nothing away
  // any more. Over the first four it leaves 0.37 of the line, with the third mode 0.03.
  const double one = of(1, Judged::by_forces, 0, 4).near_15_hz;
  EXPECT_NEAR(of(2, Judged::by_forces, 0, 4).near_15_hz / one, 0.37, 0.01);
  EXPECT_LT(of(3, Judged::by_forces, 0, 4).near_15_hz / one, 0.03);
  EXPECT_GT(of(2, Judged::by_forces, 4, 8).near_15_hz / of(1, Judged::by_forces, 4, 8).near_15_hz, 1);
}

TEST_F(OpenQuestion, ReadingOneModeByItsForcesIsWorse) {
  // Summing forces over one mode leaves 3.5 times as much as its curvature does, at 63 Hz: its torsion rings at 63 in place of 71 Hz and
  // shakes a rig that cannot give way. From two modes on it is the better reading (one_mode_test.cpp).
  const Left forces = of(1, Judged::by_forces, 0, 4), curvature = of(1, Judged::by_curvature, 0, 4);
  EXPECT_NEAR(forces.strongest, 63.05, 0.4);
  EXPECT_NEAR(forces.rms / curvature.rms, 3.5, 0.1);
  EXPECT_LT(of(2, Judged::by_forces, 0, 4).rms, 0.14 * recorded(0, 4));
}

// ------------------------------------------------------------------------------------------------ after a fit

/// The recording as a laboratory would have it: 500 Hz, noise of 0.01 deg and 0.03 N (seed 20240501).
unrig::Run recorded_run(const VectorXd& recording) {
  const SampledMotion step = step_motion();
  constexpr Index every = 4;
  const Index samples = recording.size() / every;
  std::mt19937 generator(20240501);
  std::normal_distribution<double> normal;
  Channel alpha{"alpha", "rad", "rad", 1, VectorXd(samples), 0}, gauge{"gauge", "N", "N", 1, VectorXd(samples), 0};
  for (Index k = 0; k < samples; ++k) {
    alpha.value[k] = step.angle[every * k] + 0.01 * degree * normal(generator);
    gauge.value[k] = recording[every * k] + 0.03 * normal(generator);
  }
  unrig::Run run;
  run.file = run.name = "recording";
  run.density = towed().density;
  run.speed = towed().speed;
  run.dt = every * step.dt;
  run.channels = {alpha, gauge};
  return run;
}

struct Fitted {
  FitResult result;
  Left left;  ///< of the noise-free recording by the fitted model under the true motion
  double operator[](const std::string& name) const {
    const auto found =
        std::find_if(result.parameters.begin(), result.parameters.end(), [&](const FittedParameter& p) { return p.name == name; });
    return found->value;
  }
};

Fitted fitted(int modes, const VectorXd& recording) {
  FitProblem problem;
  problem.rig = rig_from_drawings();
  problem.rig.normal.modes = modes;
  problem.runs = {recorded_run(recording)};
  Fitted f{fit(problem), {}};
  const AeroelasticModel model = seed::model(problem.rig, modes, 1, wagner(Wagner::within_1e4));
  VectorXd theta = model.start_values();
  for (std::size_t j = 0; j < model.parameters().size(); ++j) theta[static_cast<Index>(j)] = f[model.parameters()[j].name];
  const SampledMotion step = step_motion();
  f.left = left(recording - motion_response(model.system(towed(), theta, {"gauge"}), step.motion, step.dt).col(0), 0, 4);
  return f;
}

TEST_F(OpenQuestion, AFitOfOneModeBendsItsParametersToIt) {
  // Left to itself, the fit lays the torsional mode, whose place is 71 Hz, on the missing 15 Hz line: a thirteenth of the true stiffness,
  // half as much water again, and a reduced chi-square of 54. A residual spectrum alone would not show what is wrong: it is the parameters
  // that lie.
  const Fitted one = fitted(1, recording_);
  EXPECT_GT(one.result.reduced_chi2(), 20);
  EXPECT_LT(one["torsion.stiffness_scale"], 0.3);
  EXPECT_GT(one["apparent_mass_coefficient"], 1.2);
  EXPECT_NEAR(one.left.strongest, 15.08, 0.4) << "under the true motion the line is still what is left";
}

TEST_F(OpenQuestion, AFitWithOneMoreModeRemovesIt) {
  const Left without = of(1, Judged::by_curvature, 0, 4);
  const Fitted two = fitted(2, recording_);
  EXPECT_LT(two.result.reduced_chi2(), 3) << "2.0 measured, for 54; the third mode at 49 Hz is still missing";
  EXPECT_LT(two.left.near_15_hz, 0.1 * without.near_15_hz) << "N; 0.21 measured of 3.14: the stiffness scale, 0.97, moves 15.35 Hz to 15.1";
  EXPECT_LT(two.left.rms, 0.2 * without.rms);
  // The truth is 1 for all three; 3 %, 7 % and 1 % off measured.
  EXPECT_NEAR(two["normal.stiffness_scale"], 1, 0.05);
  EXPECT_NEAR(two["torsion.stiffness_scale"], 1, 0.1);
  EXPECT_NEAR(two["apparent_mass_coefficient"], 1, 0.02);
}

}  // namespace
}  // namespace unrig::seed
