// A decay with mains in its gauge channel, sampled so that harmonics lie on, below and above half the sampling rate. The recordings are closed forms.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <string>

#include "fit/diagnose/diagnose.h"
#include "fit/fit.h"
#include "fit/search/effect_search.h"

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::VectorXd;
using std::numbers::pi;

constexpr double noise = 0.02, seconds = 8;  // N, s

Rig one_mode() {
  Rig rig;
  rig.file = "rig.toml";
  rig.modal = {{2, 3, 0.01, 2 * std::pow(2 * pi * 3, 2), "N"}};
  return rig;
}

/// Ten newtons at 3.05 Hz, decaying with 1.2 % of the critical damping; a line of twice the noise, r.m.s.
Run decay_with_line(double line, double rate, unsigned seed) {
  Run run;
  run.file = "decay.csv";
  run.kind = RunKind::pluck;
  run.dt = 1 / rate;
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal(0, noise);
  const double omega = 2 * pi * 3.05, zeta = 0.012, amplitude = 2 * noise * std::sqrt(2.0);
  VectorXd gauge(static_cast<Index>(seconds * rate));
  for (Index k = 0; k < gauge.size(); ++k) {
    const double t = run.dt * static_cast<double>(k);
    gauge[k] = 10 * std::exp(-zeta * omega * t) * std::cos(omega * std::sqrt(1 - zeta * zeta) * t) + amplitude * std::sin(2 * pi * line * t + 0.7) + normal(random);
  }
  run.channels.push_back({"gauge", "N", "N", 1, gauge, 0});
  return run;
}

/// 50.05 Hz at 200 Hz: the second harmonic lies just above half the sampling rate, that of 49.95 Hz below. The number of states followed the frequency of the search, and the heap broke.
TEST(MainsHum, IsFittedWhereAHarmonicLiesAtHalfTheSamplingRate) {
  struct {
    double line, rate;
  } const recordings[] = {{50.05, 200}, {49.95, 200}, {60.1, 240}};
  for (const auto& [line, rate] : recordings) {
    FitProblem problem;
    problem.rig = one_mode();
    problem.runs = {decay_with_line(line, rate, 3)};
    problem.effects = {"mains-hum"};
    const FitResult result = fit(problem);
    const auto found = std::find_if(result.parameters.begin(), result.parameters.end(), [](const FittedParameter& p) { return p.name == "mains-hum.frequency"; });
    ASSERT_NE(found, result.parameters.end());
    EXPECT_NEAR(found->value, line, 4 * found->std_error) << rate;
    EXPECT_LT(found->std_error, 0.01) << "a line of twice the noise over 8 s: sqrt(6) / (pi T snr sqrt(n)) is 0.001 Hz or less";
    EXPECT_LT(result.reduced_chi2(), 1.2) << rate;
  }
}

TEST(MainsHum, IsNamedByADiagnosis) {
  struct {
    double line, rate;
  } const recordings[] = {{50.05, 200}, {59.93, 256}, {49.87, 1000}};
  for (const auto& [line, rate] : recordings) {
    DiagnoseProblem problem;
    problem.rig = one_mode();
    problem.runs = {decay_with_line(line, rate, 5)};
    problem.verdict_only = true;
    const Diagnosis d = diagnose(problem);
    ASSERT_EQ(d.missing.size(), 1u) << line << " Hz at " << rate << (d.closest.empty() ? "" : ", closest is " + d.closest.front().effect);
    EXPECT_EQ(d.missing.front().effect, "mains-hum");
  }
}

/// Adds noise of first order of that many newtons below 20 Hz, and harmonics of the line so many times the noise.
Run with_coloured_noise(Run run, double coloured, double harmonics, unsigned seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  const double a = std::exp(-2 * pi * 20 * run.dt);
  VectorXd& gauge = run.channels.front().value;
  double n = coloured * normal(random);
  for (Index k = 0; k < gauge.size(); ++k) {
    const double t = run.dt * static_cast<double>(k);
    gauge[k] += n + harmonics * noise * (std::sin(2 * pi * 100.1 * t + 0.3) + std::sin(2 * pi * 150.15 * t));
    n = a * n + std::sqrt(1 - a * a) * coloured * normal(random);
  }
  return run;
}

/// Differences take harmonics for noise: levels ten times too high in some of the runs hid the colour that all have in common, and the runs stayed unexplained.
TEST(MainsHum, HidesNoColourOfTheNoise) {
  DiagnoseProblem problem;
  problem.rig = one_mode();
  unsigned seed = 12;
  for (const double harmonics : {0.3, 8.0, 12.0}) {
    problem.runs.push_back(with_coloured_noise(decay_with_line(50.05, 500, seed), 1.5 * noise, harmonics, seed + 5));
    problem.runs.back().file = "decay_" + std::to_string(seed++) + ".csv";
  }
  problem.verdict_only = true;
  const Diagnosis d = diagnose(problem);
  ASSERT_EQ(d.missing.size(), 1u) << (d.closest.empty() ? "" : ", closest is " + d.closest.front().effect);
  EXPECT_EQ(d.missing.front().effect, "mains-hum");
  EXPECT_FALSE(d.unexplained);
}

/// "45.47 Hz" was named once, whose third harmonic sat on a mode of the structure.
TEST(MainsHum, IsNoLineElsewhere) {
  DiagnoseProblem problem;
  problem.rig = one_mode();
  problem.runs = {decay_with_line(45.47, 500, 7)};
  problem.effects = {"mains-hum"};
  problem.verdict_only = true;
  const Diagnosis d = diagnose(problem);
  EXPECT_THAT(d.missing, testing::IsEmpty());
  EXPECT_TRUE(d.unexplained);
}

/// Harmonics that a run is explained as well without are no unknowns that the evidence pays for; what they take of the noise is left of the run.
TEST(MainsHum, PaysForTheHarmonicsThatThereAre) {
  FitProblem problem;
  problem.rig = one_mode();
  problem.runs = {decay_with_line(50.02, 400, 9)};
  const Trial base = fit_baseline(problem);
  Trial hum = prepare(problem, base, {"mains-hum"});
  fit_fully(hum, 3);
  constexpr int frequency = 1, one_harmonic = 2;
  EXPECT_EQ(hum.variables - base.variables, frequency + one_harmonic);
  const auto samples = static_cast<double>(problem.runs.front().samples());
  const double taken = samples * hum.variance.front() - hum.arrival.joint.chi2();
  EXPECT_GT(taken, 0);
  EXPECT_LT(taken, 4 * std::log(samples)) << "two harmonics, each less than it costs";
}

}  // namespace
}  // namespace unrig
