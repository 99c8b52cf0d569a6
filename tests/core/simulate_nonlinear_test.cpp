// `simulate` with nonlinear effects, against closed forms and an integrator that shares no code with it.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numbers>

#include "core/model/simulate.h"
#include "tests/support/sample_data.h"

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::VectorXd;
using std::numbers::pi;
using testing::HasSubstr;

constexpr double mass = 2, frequency = 2.5, omega = 2 * pi * frequency, stiffness = mass * omega * omega;

/// One mode whose gauge reads k x [N], let go from `load` [N], with an effect of these parameters at work.
VectorXd decay(double damping_ratio, double load, double dt, double seconds, const std::string& effect, const std::vector<double>& parameters, Index law_steps = 1) {
  Rig rig;
  rig.file = "rig.toml";
  rig.modal = {{mass, frequency, damping_ratio, stiffness, "N"}};
  AeroelasticModel model(rig, {}, wagner(Wagner::jones));
  if (!effect.empty()) model = model.with_effects({effect});
  VectorXd theta = model.start_values();
  for (std::size_t k = 0; k < parameters.size(); ++k) theta[theta.size() - static_cast<Index>(parameters.size() - k)] = parameters[k];
  unrig::Run run;
  run.kind = RunKind::pluck;
  run.dt = dt;
  run.channels.push_back({"note", "1", "1", 1, VectorXd::Zero(static_cast<Index>(std::lround(seconds / dt)) + 1), 0});
  SimulateProblem problem{model, theta, run, {}, {}, {}};
  problem.release_load = load;
  problem.law_steps = law_steps;
  return simulate(problem).run.channel("gauge").value;
}

/// k x of m x'' + c x' + k x = force(x, x') by the classical Runge-Kutta method with twenty steps a sample.
VectorXd runge_kutta(double damping_ratio, double load, double dt, double seconds, const std::function<double(double, double)>& force) {
  constexpr int finer = 20;
  const double h = dt / finer, c = 2 * damping_ratio * mass * omega;
  using State = Eigen::Vector2d;
  const auto slope = [&](const State& s) { return State(s[1], (force(s[0], s[1]) - c * s[1] - stiffness * s[0]) / mass); };
  State s(load / stiffness, 0);
  VectorXd reading(static_cast<Index>(std::lround(seconds / dt)) + 1);
  for (double& y : reading) {
    y = stiffness * s[0];
    for (int i = 0; i < finer; ++i) {
      const State a = slope(s), b = slope(s + h / 2 * a), d = slope(s + h / 2 * b), e = slope(s + h * d);
      s += h / 6 * (a + 2 * b + 2 * d + e);
    }
  }
  return reading;
}

TEST(SimulateNonlinear, QuadraticDragMeetsRungeKutta) {
  constexpr double zeta = 0.01, load = 100, seconds = 4, coefficient = 8;  // halves the amplitude in about three cycles
  const auto drag = [](double, double v) { return -coefficient * std::abs(v) * v; };
  const auto miss = [&](double dt) {
    return (decay(zeta, load, dt, seconds, "quadratic-drag", {coefficient}) - runge_kutta(zeta, load, dt, seconds, drag)).cwiseAbs().maxCoeff();
  };
  const double coarse = miss(4e-3), fine = miss(2e-3);
  // (omega dt)^4 / 720 of the force is missed, 2e-8 at 4 ms, 81 times as much of its third harmonic; where the velocity changes sign the force's second derivative jumps by up to four times
  // omega^2 of it, of which a parabola through three points misses up to a sixteenth over a step: (omega dt)^3 / 16, 1.6e-5, twice in each of
  // ten periods, of a drag that is a third of the spring's force on the mean.
  EXPECT_LT(coarse, 1e-4 * load);
  EXPECT_GT(coarse / fine, 5) << "third order";
  const VectorXd with = decay(zeta, load, 2e-3, seconds, "quadratic-drag", {coefficient}), without = decay(zeta, load, 2e-3, seconds, "", {});
  EXPECT_LT(with.tail(400).cwiseAbs().maxCoeff(), 0.7 * without.tail(400).cwiseAbs().maxCoeff());
  EXPECT_GT(coarse, 0) << "two integrators, not one";
}

/// In twice as many steps a sample a law does what it does at twice the sampling rate.
TEST(SimulateNonlinear, FollowsLawsInTheStepsOfAFit) {
  const VectorXd finer = decay(0.01, 100, 4e-3, 2, "quadratic-drag", {8}, 2), faster = decay(0.01, 100, 2e-3, 2, "quadratic-drag", {8}), coarse = decay(0.01, 100, 4e-3, 2, "quadratic-drag", {8});
  const VectorXd same = faster(Eigen::seqN(0, finer.size(), 2));
  EXPECT_LT((finer - same).cwiseAbs().maxCoeff(), 1e-9);
  EXPECT_GT((coarse - same).cwiseAbs().maxCoeff(), 1e-5);
}

TEST(SimulateNonlinear, CubicStiffnessMeetsRungeKutta) {
  constexpr double zeta = 0.01, load = 100, seconds = 4, share = 0.8, k3 = share * stiffness * stiffness * stiffness / (load * load);
  const auto miss = [&](double dt) {
    return (decay(zeta, load, dt, seconds, "cubic-stiffness", {k3, 0}) - runge_kutta(zeta, load, dt, seconds, [&](double x, double) { return -k3 * x * x * x; })).cwiseAbs().maxCoeff();
  };
  const double coarse = miss(8e-3), fine = miss(4e-3);
  EXPECT_NEAR(coarse / fine, 16, 1) << "fourth order";
}

TEST(SimulateNonlinear, DryFrictionTakesTheSameFromEveryCycle) {
  // Released from x0 without viscous damping the rig turns at x0 - 4 n F/k after n periods, which friction leaves as they are.
  constexpr double load = 100, friction = 3, dt = 1e-3, period = 1 / frequency;
  constexpr int cycles = 6;
  const VectorXd reading = decay(0, load, dt, (cycles + 0.5) * period, "coulomb-friction", {friction, 1e-5});
  for (int n = 1; n <= cycles; ++n) {
    const double turn = reading[static_cast<Index>(std::lround(n * period / dt))];
    // While the velocity changes sign the force takes a sample at most to follow, during which the rig moves by (omega dt)^2 / 2 of its amplitude: 1.2e-4 of a decrement,
    // and being late by half a sample each time shifts the phase; 1 % of a decrement is far above both and far below the 4 F.
    EXPECT_NEAR(turn, load - 4 * friction * n, 0.01 * 4 * friction) << n;
  }
}

TEST(SimulateNonlinear, CubicStiffnessHasDuffingsPeriod) {
  // x'' + omega^2 x + e x^3 = 0 from x = a at rest: T = 4 K(m) / sqrt(omega^2 + e a^2), m = e a^2 / (2 (omega^2 + e a^2)).
  constexpr double load = 100, dt = 1e-3, a = load / stiffness;
  for (const double share : {0.8, 0.2, -0.3}) {  // e a^2 over omega^2
    const double squared = omega * omega * (1 + share), m = share / (2 * (1 + share));
    // The complete elliptic integral by the arithmetic-geometric mean, which takes negative m too.
    double one = 1, other = std::sqrt(1 - m);
    for (int i = 0; i < 8; ++i) {
      const double mean = (one + other) / 2;
      other = std::sqrt(one * other);
      one = mean;
    }
    const double period = 4 * (pi / (2 * one)) / std::sqrt(squared);
    const VectorXd reading = decay(0, load, dt, 10.2 * period, "cubic-stiffness", {share * stiffness / (a * a), 0});
    std::vector<double> crossings;  // downwards
    for (Index k = 0; k + 1 < reading.size(); ++k)
      if (reading[k] > 0 && reading[k + 1] <= 0) crossings.push_back(dt * (static_cast<double>(k) + reading[k] / (reading[k] - reading[k + 1])));
    ASSERT_GE(crossings.size(), 10u);
    // (omega dt)^4 / 720 = 8e-11 of the cubic force, whose share is at most one, and 81 times as much of its third harmonic.
    EXPECT_NEAR((crossings[9] - crossings[0]) / 9 / period, 1, 1e-8) << share;
  }
}

/// k x of m x'' + c x' + k x = -F z, z' = v/x_y (1 - |z|^n (b + (1 - b) sign(v z))), as runge_kutta.
VectorXd runge_kutta_of_hysteresis(double damping_ratio, double load, double dt, double seconds, double F, double yield, double b, double n) {
  constexpr int finer = 40;
  const double h = dt / finer, c = 2 * damping_ratio * mass * omega;
  using State = Eigen::Vector3d;
  const auto slope = [&](const State& s) {
    const double side = s[1] * s[2] > 0 ? 1 : s[1] * s[2] < 0 ? -1 : 0;
    return State(s[1], (-F * s[2] - c * s[1] - stiffness * s[0]) / mass, s[1] / yield * (1 - std::pow(std::abs(s[2]), n) * (b + (1 - b) * side)));
  };
  State s(load / stiffness, 0, 0);
  VectorXd reading(static_cast<Index>(std::lround(seconds / dt)) + 1);
  for (double& y : reading) {
    y = stiffness * s[0];
    for (int i = 0; i < finer; ++i) {
      const State a = slope(s), d = slope(s + h / 2 * a), e = slope(s + h / 2 * d), f = slope(s + h * e);
      s += h / 6 * (a + 2 * d + 2 * e + f);
    }
  }
  return reading;
}

TEST(SimulateNonlinear, HysteresisMeetsRungeKutta) {
  constexpr double zeta = 0.005, load = 100, seconds = 4, F = 12, yield = 0.15 * load / stiffness, b = 0.3, n = 1.5;
  const auto miss = [&](double dt) {
    return (decay(zeta, load, dt, seconds, "bouc-wen", {F, yield, b, n}) - runge_kutta_of_hysteresis(zeta, load, dt, seconds, F, yield, b, n)).cwiseAbs().maxCoeff();
  };
  const double coarse = miss(4e-3), fine = miss(2e-3);
  // Where the rig turns the rate of the memory has a kink, which a sample misses by the square of its length, a quarter of (omega dt)^2 at most: 1e-3 at 4 ms.
  EXPECT_LT(coarse, 1e-3 * F);
  EXPECT_GT(coarse / fine, 3) << "second order";
  EXPECT_GT(coarse, 0) << "two integrators, not one";
}

TEST(SimulateNonlinear, HysteresisTakesWhatItsLoopEncloses) {
  // With b = 1/2 and n = 1 the force goes from -F to F over 5/2 x_y less work than if it did so at once: 1 - z is 1 to 2 over the first x_y (3/2 in all), then exp(-x/x_y) (1).
  // Between turns x0 and x1 that leaves k/2 (x0^2 - x1^2) = F (x0 + x1 - d), d = 5/2 x_y, after the release, where z begins at 0, x_y.
  constexpr double load = 100, F = 3, dt = 1e-3, yield = 0.02 * load / stiffness;
  const VectorXd reading = decay(0, load, dt, 3.2 / frequency, "bouc-wen", {F, yield, 0.5, 1});
  std::vector<double> turns{load};
  for (Index k = 1; k + 1 < reading.size(); ++k)
    if ((reading[k] - reading[k - 1]) * (reading[k + 1] - reading[k]) < 0) {  // the parabola through three samples
      const double slope = (reading[k + 1] - reading[k - 1]) / 2, bend = reading[k + 1] - 2 * reading[k] + reading[k - 1];
      turns.push_back(std::abs(reading[k] - slope * slope / (2 * bend)));
    }
  ASSERT_GE(turns.size(), 6u);
  for (std::size_t i = 0; i + 1 < 6; ++i) {
    const double missing = (i == 0 ? 1 : 2.5) * stiffness * yield, lost = 2 * F * (1 - missing / (turns[i] + turns[i + 1]));
    EXPECT_NEAR(turns[i] - turns[i + 1], lost, 0.005 * 2 * F) << i;  // a fifth of what the loop's corners take from that of dry friction
  }
}

TEST(SimulateNonlinear, HysteresisWithoutALoopIsASpring) {
  // With b = 1 and n = 1 the force is F (1 - exp(-|x - x_0|/x_y)) whichever way the rig goes: every turn is as far out as the one before it on that side.
  constexpr double load = 100, F = 10, dt = 1e-3, yield = 0.5 * load / stiffness;
  const VectorXd reading = decay(0, load, dt, 4, "bouc-wen", {F, yield, 1, 1});
  EXPECT_NEAR(reading.tail(500).maxCoeff(), load, 1e-3 * load);
  const VectorXd linear = decay(0, load, dt, 4, "", {});
  EXPECT_GT((reading - linear).cwiseAbs().maxCoeff(), 0.1 * load) << "it is at work";
}

class SimulateNonlinearStep : public testing::Test {
 protected:
  static SimulateProblem problem(const std::string& effect) {
    const Rig rig = read_rig(test::null_campaign("rig.toml"));
    AeroelasticModel model(rig, make_basis(rig, Index{2}, Index{1}), wagner(Wagner::jones));
    if (!effect.empty()) model = model.with_effects({effect});
    unrig::Run run;
    run.file = "step.csv";
    run.density = 998.2;
    run.speed = 0.6;
    run.dt = 0.004;
    VectorXd alpha(500);
    for (Index k = 0; k < alpha.size(); ++k) alpha[k] = 0.03 + 0.02 * (1 + std::tanh((static_cast<double>(k) - 120) / 6));
    run.channels.push_back({"alpha", "rad", "rad", 1, alpha, 0});
    return {model, model.start_values(), run, {}, {}, {}};
  }
};

TEST_F(SimulateNonlinearStep, WithoutItsForceIsTheLinearOne) {
  const VectorXd linear = simulate(problem("")).run.channel("gauge").value;
  SimulateProblem drag = problem("quadratic-drag");
  EXPECT_LT((simulate(drag).run.channel("gauge").value - linear).cwiseAbs().maxCoeff(), 1e-10 * linear.cwiseAbs().maxCoeff());
  drag.theta[drag.theta.size() - 1] = 20;
  const VectorXd damped = simulate(drag).run.channel("gauge").value;
  const auto swing = [&](const VectorXd& y) { return y.tail(200).maxCoeff() - y.tail(200).minCoeff(); };
  EXPECT_LT(swing(damped), 0.99 * swing(linear)) << "it rings less after the step";
  EXPECT_NEAR(damped[0], linear[0], 1e-12 * std::abs(linear[0])) << "and starts in the same steady state";
}

TEST_F(SimulateNonlinearStep, RefusesJumps) {
  SimulateProblem drag = problem("quadratic-drag");
  drag.pitch = PitchBetweenSamples::jumps;
  try {
    simulate(drag);
    FAIL() << "accepted";
  } catch (const InputError& e) {
    EXPECT_THAT(e.what(), HasSubstr("the angle jumps while a nonlinear effect is at work"));
  }
  SimulateProblem lag = problem("wagner-lag");
  lag.pitch = PitchBetweenSamples::jumps;
  EXPECT_NO_THROW(simulate(lag));
}

TEST_F(SimulateNonlinearStep, SignalsStartAsTold) {
  SimulateProblem wave = problem("tank-wave");
  const VectorXd still = simulate(wave).run.channel("gauge").value;
  EXPECT_LT((still - simulate(problem("")).run.channel("gauge").value).cwiseAbs().maxCoeff(), 1e-10 * still.cwiseAbs().maxCoeff());
  wave.signals = Eigen::Vector2d(3, 0);
  EXPECT_GT((simulate(wave).run.channel("gauge").value - still).cwiseAbs().maxCoeff(), 1);
  wave.signals = VectorXd::Ones(3);
  EXPECT_THROW(simulate(wave), std::invalid_argument);
}

/// A linear rig answers to a signal that jumps in the middle as to one that begins there.
TEST_F(SimulateNonlinearStep, SignalsThatStepAddUp) {
  SimulateProblem wave = problem("tank-wave");
  const VectorXd still = simulate(wave).run.channel("gauge").value;
  wave.signals = Eigen::Vector2d(3, 1);
  const VectorXd from_the_start = simulate(wave).run.channel("gauge").value - still;
  const Eigen::Index samples = wave.run.samples(), later = samples / 3;
  wave.signals.setZero();
  wave.signal_steps = Eigen::MatrixXd::Zero(samples, 2);
  EXPECT_LT((simulate(wave).run.channel("gauge").value - still).cwiseAbs().maxCoeff(), 1e-9 * still.cwiseAbs().maxCoeff()) << "step by step";
  wave.signal_steps.row(later - 1) << 3, 1;
  const VectorXd with_it = simulate(wave).run.channel("gauge").value - still;
  EXPECT_LT(with_it.head(later).cwiseAbs().maxCoeff(), 1e-9 * still.cwiseAbs().maxCoeff());
  EXPECT_LT((with_it.tail(samples - later) - from_the_start.head(samples - later)).cwiseAbs().maxCoeff(), 1e-9 * still.cwiseAbs().maxCoeff());
  wave.signal_steps.resize(samples - 1, 2);
  EXPECT_THROW(simulate(wave), std::invalid_argument);
}

}  // namespace
}  // namespace unrig
