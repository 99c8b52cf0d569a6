// `higher-mode` on a rig known only as modes is one mode more; `cubic-damping` and `quadratic-drag` where there is no fluid, or only air. Recordings are closed forms, or by an integrator
// that shares no code with the fit.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numbers>
#include <random>

#include "core/files/error.h"
#include "core/model/simulate.h"
#include "fit/diagnose/diagnose.h"
#include "fit/fit.h"
#include "tests/support/sample_data.h"

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::VectorXd;
using std::numbers::pi;
using testing::HasSubstr;

constexpr double mass = 2, hertz = 3, omega = 2 * pi * hertz, stiffness = mass * omega * omega, noise = 0.02, dt = 2e-3;

Rig one_mode() {
  Rig rig;
  rig.file = "rig.toml";
  rig.modal = {{mass, hertz, 0.01, stiffness, "N"}};
  return rig;
}

Run pluck_of(VectorXd gauge, unsigned seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal(0, noise);
  for (double& y : gauge) y += normal(random);
  Run run;
  run.file = "pluck" + std::to_string(seed) + ".csv";
  run.kind = RunKind::pluck;
  run.dt = dt;
  run.channels.push_back({"gauge", "N", "N", 1, gauge, 0});
  return run;
}

const FittedParameter& parameter(const FitResult& result, const std::string& name) {
  for (const FittedParameter& p : result.parameters)
    if (p.name == name) return p;
  ADD_FAILURE() << "no parameter " << name;
  return result.parameters.front();
}

/// Two modes of which the rig file knows the first.
VectorXd two_tones(double amplitude, double phase) {
  VectorXd gauge(3000);
  for (Index k = 0; k < gauge.size(); ++k) {
    const double t = dt * static_cast<double>(k), second = 2 * pi * 17.3;
    gauge[k] = 8 * std::exp(-0.012 * omega * t) * std::cos(omega * t) + amplitude * std::exp(-0.015 * second * t) * std::cos(second * t + phase);
  }
  return gauge;
}

TEST(MissingMode, IsFittedOnARigOfModes) {
  FitProblem problem;
  problem.rig = one_mode();
  problem.runs = {pluck_of(two_tones(1, 0.3), 1), pluck_of(two_tones(0.7, -0.4), 2)};
  problem.effects = {"higher-mode"};
  const FitResult result = fit(problem);
  EXPECT_LT(result.reduced_chi2(), 1.2);
  // Undamped frequency of a tone that is written with the damped one.
  const FittedParameter& frequency = parameter(result, "higher-mode.frequency");
  EXPECT_NEAR(frequency.value, 17.3 * std::sqrt(1 + 0.015 * 0.015), 4 * frequency.std_error);
  EXPECT_NEAR(parameter(result, "higher-mode.damping_ratio").value, 0.015 / std::sqrt(1 + 0.015 * 0.015), 4 * parameter(result, "higher-mode.damping_ratio").std_error);
  EXPECT_FALSE(parameter(result, "higher-mode.participation").identified) << "a free decay has no force";
  EXPECT_THAT(parameter(result, "higher-mode.participation").advice, HasSubstr("measured force"));
  // Advice belongs to the parameter, and to the runs that there are.
  EXPECT_THAT(parameter(result, "modal[1].mass").advice, HasSubstr("measured force"));
  for (const FittedParameter& p : result.parameters) EXPECT_THAT(p.advice, testing::Not(HasSubstr("Record a free decay."))) << p.name << ": these are two";
}

TEST(MissingMode, IsNamedOnARigOfModes) {
  DiagnoseProblem problem;
  problem.rig = one_mode();
  problem.runs = {pluck_of(two_tones(1, 0.3), 1), pluck_of(two_tones(0.7, -0.4), 2)};
  problem.verdict_only = true;
  problem.effects = {"higher-mode", "cubic-stiffness", "coulomb-friction", "quadratic-drag", "cubic-damping"};
  const Diagnosis d = diagnose(problem);
  ASSERT_EQ(d.missing.size(), 1u);
  EXPECT_EQ(d.missing.front().effect, "higher-mode");
}

/// gauge = k x of m x'' + c x' + k x = force(x, x'), let go from `load` [N], by the classical Runge-Kutta method with ten steps a sample.
VectorXd let_go(double load, double seconds, const std::function<double(double)>& force_of_velocity) {
  constexpr int finer = 10;
  const double h = dt / finer, c = 2 * 0.004 * mass * omega;
  using State = Eigen::Vector2d;
  const auto slope = [&](const State& s) { return State(s[1], (force_of_velocity(s[1]) - c * s[1] - stiffness * s[0]) / mass); };
  State s(load / stiffness, 0);
  VectorXd reading(static_cast<Index>(seconds / dt));
  for (double& y : reading) {
    y = stiffness * s[0];
    for (int i = 0; i < finer; ++i) {
      const State a = slope(s), b = slope(s + h / 2 * a), d = slope(s + h / 2 * b), e = slope(s + h * d);
      s += h / 6 * (a + 2 * b + 2 * d + e);
    }
  }
  return reading;
}

TEST(CubicDamping, IsFittedAndNamedWithoutAFluid) {
  const double fastest = 20 / (mass * omega), coefficient = 0.06 * 20 / std::pow(fastest, 3);
  const auto joint = [&](double v) { return -coefficient * v * v * v; };
  const std::vector<unrig::Run> runs{pluck_of(let_go(20, 6, joint), 3), pluck_of(let_go(6, 6, joint), 4)};
  FitProblem problem;
  problem.rig = one_mode();
  problem.runs = runs;
  problem.effects = {"cubic-damping"};
  const FitResult result = fit(problem);
  EXPECT_LT(result.reduced_chi2(), 1.2);
  // Of a mode the data determine forces per mass: the mass is held at the rig file's, which is the truth.
  EXPECT_NEAR(parameter(result, "cubic-damping.coefficient").value, coefficient, 4 * parameter(result, "cubic-damping.coefficient").std_error);
  DiagnoseProblem diagnosis;
  diagnosis.rig = problem.rig;
  diagnosis.runs = runs;
  diagnosis.verdict_only = true;
  diagnosis.effects = {"cubic-damping", "quadratic-drag", "coulomb-friction", "cubic-stiffness"};
  const Diagnosis d = diagnose(diagnosis);
  ASSERT_EQ(d.missing.size(), 1u);
  EXPECT_EQ(d.missing.front().effect, "cubic-damping");
}

/// A free decay of the seed's rig with drag on its strips, in a fluid of this density.
unrig::Run decay_with_drag(const Rig& rig, double density, double coefficient) {
  const AeroelasticModel model = AeroelasticModel(rig, make_basis(rig, 0.5 / dt, density), wagner(Wagner::jones)).with_effects({"quadratic-drag"});
  VectorXd theta = model.start_values();
  theta[model.index("quadratic-drag.coefficient")] = coefficient;
  unrig::Run run;
  run.file = "decay.csv";
  run.kind = RunKind::pluck;
  run.dt = dt;
  run.density = density;
  run.channels.push_back({"note", "1", "1", 1, VectorXd::Zero(2000), 0});
  SimulateProblem problem{model, theta, run, {}, {}, {}};
  problem.release_load = 20;
  const VectorXd gauge = simulate(problem).run.channel("gauge").value;
  run = pluck_of(gauge, 6);
  run.density = density;
  return run;
}

/// In air it was not looked for although it was named: "these runs do not respond to it".
TEST(QuadraticDrag, IsFoundInALiquidAndRefusedWhereThereIsNone) {
  Rig rig = read_rig(test::null_campaign("rig.toml"));
  rig.normal.modes = 2;
  constexpr double truth = 4.8;
  FitProblem problem;
  problem.rig = rig;
  problem.runs = {decay_with_drag(rig, 998.2, truth), decay_with_drag(rig, 1.2, truth)};  // one alone hardly tells stiffness from apparent mass, nor drag from both
  problem.runs.back().file = "dry.csv";
  problem.effects = {"quadratic-drag"};
  const FitResult result = fit(problem);
  const FittedParameter& drag = parameter(result, "quadratic-drag.coefficient");
  EXPECT_TRUE(drag.identified) << drag.advice;
  EXPECT_NEAR(drag.value, truth, 4 * drag.std_error);
  EXPECT_LT(drag.std_error, 0.2 * truth) << "otherwise this says nothing";
  for (const double density : {0.0, 1.2}) {
    for (unrig::Run& run : problem.runs) run.density = density;
    try {
      fit(problem);
      FAIL() << "nothing to be dragged through";
    } catch (const InputError& e) {
      EXPECT_THAT(e.what(), testing::AllOf(HasSubstr("quadratic-drag"), HasSubstr("liquid"), HasSubstr("cubic-damping")));
    }
  }
}

}  // namespace
}  // namespace unrig
