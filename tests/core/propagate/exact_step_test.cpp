#include "core/propagate/exact_step.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "tests/support/slope.h"

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::Vector4d;
using Eigen::VectorXd;

/// x'' + 2 zeta omega x' + omega^2 x = p + u with the prescribed p as states: x, x', p, p', p''.
LinearSystem oscillator(double omega, double zeta) {
  LinearSystem s;
  s.A = DualMatrix(MatrixXd::Zero(5, 5));
  s.A.value(0, 1) = 1;
  s.A.value.row(1) << -omega * omega, -2 * zeta * omega, 1, 0, 0;
  s.A.value(2, 3) = s.A.value(3, 4) = 1;
  s.B = DualMatrix(MatrixXd::Zero(5, 1));
  s.B.value(1, 0) = 1;
  s.C = DualMatrix(MatrixXd::Identity(5, 5));
  s.D = DualMatrix(MatrixXd::Zero(5, 1));
  s.coordinates = 1;
  s.motion = 2;
  return s;
}

/// The same equation in closed form for a right-hand side f0 + f1 t + f2 t^2 + f3 t^3: a polynomial and a damped vibration.
Eigen::Vector2d closed_form(double omega, double zeta, const Vector4d& f, const Eigen::Vector2d& start, double t) {
  const double w2 = omega * omega, d = 2 * zeta * omega;
  Vector4d c;
  c[3] = f[3] / w2;
  c[2] = (f[2] - 3 * d * c[3]) / w2;
  c[1] = (f[1] - 2 * d * c[2] - 6 * c[3]) / w2;
  c[0] = (f[0] - d * c[1] - 2 * c[2]) / w2;
  const double decay = zeta * omega, damped = omega * std::sqrt(1 - zeta * zeta);
  const double a = start[0] - c[0], b = (start[1] - c[1] + decay * a) / damped;
  const double e = std::exp(-decay * t), cosine = std::cos(damped * t), sine = std::sin(damped * t);
  return {c[0] + t * (c[1] + t * (c[2] + t * c[3])) + e * (a * cosine + b * sine),
          c[1] + t * (2 * c[2] + t * 3 * c[3]) + e * ((b * damped - decay * a) * cosine - (a * damped + decay * b) * sine)};
}

/// Terms of the closed form cancel: omega dt = 0.3 to the third power.
constexpr double tolerance = 1e-13;

TEST(ExactStep, OfAnOscillatorUnderACubicIsItsClosedForm) {
  for (const double dt : {0.01, 0.5, 4.0}) {
    const double omega = 30, zeta = 0.02;
    const ExactStep step = exact_step(oscillator(omega, zeta), dt);
    EXPECT_EQ(step.dt, dt);
    const double p = 0.7, rate = -3, acceleration = 5, jerk = 11;
    VectorXd state(5);
    state << 0.01, -0.2, p, rate, acceleration;
    const VectorXd next = step.transition.value * state + jerk * step.jerk.value;
    const Eigen::Vector2d expected = closed_form(omega, zeta, {p, rate, acceleration / 2, jerk / 6}, state.head<2>(), dt);
    const double size = 1 + jerk * dt * dt * dt;
    EXPECT_NEAR(next[0], expected[0], tolerance * size);
    EXPECT_NEAR(next[1], expected[1], tolerance * size * omega);
    EXPECT_NEAR(next[2], p + dt * (rate + dt * (acceleration / 2 + dt * jerk / 6)), tolerance * size);
    EXPECT_NEAR(next[3], rate + dt * (acceleration + dt * jerk / 2), tolerance * size);
    EXPECT_NEAR(next[4], acceleration + dt * jerk, tolerance * size);
  }
}

TEST(ExactStep, OfAnOscillatorUnderALinearInputIsItsClosedForm) {
  const double omega = 30, zeta = 0.02, dt = 0.01, before = 2, after = -5;
  const ExactStep step = exact_step(oscillator(omega, zeta), dt);
  VectorXd state = VectorXd::Zero(5);
  state.head<2>() << 0.01, -0.2;
  const VectorXd next = step.transition.value * state + step.input0.value * before + step.input1.value * after;
  const Eigen::Vector2d expected = closed_form(omega, zeta, {before, (after - before) / dt, 0, 0}, state.head<2>(), dt);
  EXPECT_NEAR(next[0], expected[0], tolerance);
  EXPECT_NEAR(next[1], expected[1], tolerance * omega);
}

TEST(ExactStep, OfAnOscillatorUnderASplineIsItsClosedForm) {
  for (const double dt : {0.01, 0.5, 4.0}) {
    const double omega = 30, zeta = 0.02;
    const Vector4d force(2, -5, 7, -3);
    LinearSystem s = oscillator(omega, zeta);
    s.B = s.B.grown(5, 2);
    s.curved = 1;
    const auto value = [&](double t) { return force[0] + t * (force[1] + t * (force[2] + t * force[3])); };
    const auto curvature = [&](double t) { return 2 * force[2] + 6 * t * force[3]; };
    const MatrixXd input{{value(0), curvature(0)}, {value(dt), curvature(dt)}};
    const ExactStep step = exact_step(s, dt);
    VectorXd state = VectorXd::Zero(5);
    state.head<2>() << 0.01, -0.2;
    const VectorXd next = step.transition.value * state + step.input0.value * input.row(0).transpose() + step.input1.value * input.row(1).transpose();
    const Eigen::Vector2d expected = closed_form(omega, zeta, force, state.head<2>(), dt);
    const double size = 1 + input.cwiseAbs().maxCoeff() * dt * dt;
    EXPECT_NEAR(next[0], expected[0], tolerance * size) << dt;
    EXPECT_NEAR(next[1], expected[1], tolerance * size * omega) << dt;
    for (const double share : {0.0, 0.3, 1.0}) EXPECT_NEAR(input_between(s, input, dt, 0, share, 0), value(share * dt), 1e-14 * size * std::abs(force.sum())) << dt;
  }
}

TEST(ExactStep, WithoutMotionAndInputsHasNoColumnsForThem) {
  LinearSystem s = oscillator(30, 0.02);
  s.A = s.A.block(0, 0, 2, 2);
  s.B = DualMatrix(MatrixXd(2, 0));
  s.motion = -1;
  const ExactStep step = exact_step(s, 0.01);
  EXPECT_EQ(step.jerk.value.size(), 0);
  EXPECT_EQ(step.input0.cols(), 0);
  EXPECT_EQ(step.transition.rows(), 2);
}

/// Any system: lags beside vibrations, two inputs, prescribed motion in the last three of seven states. `curved`: inputs that are splines.
LinearSystem any_system(double theta, Index curved = 0) {
  std::mt19937_64 engine(7);
  std::normal_distribution<double> normal;
  const auto random = [&](Index rows, Index cols) { return MatrixXd(MatrixXd::NullaryExpr(rows, cols, [&] { return normal(engine); })); };
  LinearSystem s;
  s.A = DualMatrix(MatrixXd::Zero(7, 7), 1);
  s.A.value.topRows(4) = random(4, 7);
  s.A.value.topLeftCorner(4, 4) -= 4 * MatrixXd::Identity(4, 4);
  MatrixXd change = MatrixXd::Zero(7, 7);
  change.topRows(4) = random(4, 7);
  s.A.value += theta * change;
  s.A.add_partial(0, change);
  s.A.value(4, 5) = s.A.value(5, 6) = 1;
  s.B = DualMatrix(MatrixXd::Zero(7, 2), 1);
  s.B.value.topRows(4) = random(4, 2);
  change = MatrixXd::Zero(7, 2);
  change.topRows(4) = random(4, 2);
  s.B.value += theta * change;
  s.B.add_partial(0, change);
  s.B = s.B.grown(7, 2 + curved);
  s.C = DualMatrix(MatrixXd::Identity(7, 7), 1);
  s.D = DualMatrix(MatrixXd::Zero(7, 2 + curved), 1);
  s.curved = curved;
  s.motion = 4;
  return s;
}

TEST(ExactStep, IsWhereRungeKuttaConvergesTo) {
  const LinearSystem s = any_system(0);
  const double dt = 0.7, jerk = 3;
  const Eigen::Vector2d u0(1, -2), u1(0.5, 4);
  const VectorXd start = VectorXd::LinSpaced(7, -1, 2);
  const ExactStep step = exact_step(s, dt);
  const VectorXd exact = step.transition.value * start + jerk * step.jerk.value + step.input0.value * u0 + step.input1.value * u1;

  const auto rate = [&](double t, const VectorXd& x) -> VectorXd {
    VectorXd r = s.A.value * x + s.B.value * (u0 + (u1 - u0) * t / dt);
    r[6] += jerk;
    return r;
  };
  const auto runge_kutta = [&](int steps) {
    const double h = dt / steps;
    VectorXd x = start;
    for (int k = 0; k < steps; ++k) {
      const double t = h * k;
      const VectorXd k1 = rate(t, x), k2 = rate(t + h / 2, x + h / 2 * k1), k3 = rate(t + h / 2, x + h / 2 * k2), k4 = rate(t + h, x + h * k3);
      x += h / 6 * (k1 + 2 * k2 + 2 * k3 + k4);
    }
    return (x - exact).norm();
  };
  const double coarse = runge_kutta(50), fine = runge_kutta(100);
  EXPECT_NEAR(std::log2(coarse / fine), 4, 0.2) << "the classical method has order 4";
  EXPECT_LT(runge_kutta(4000), 1e-12 * exact.norm()) << "(0.7 / 4000)^4 is below round-off";
}

TEST(ExactStep, CarriesItsSlopes) {
  const double dt = 0.7;
  const ExactStep here = exact_step(any_system(0, 2), dt);
  const auto check = [&](auto part, const char* name) {
    EXPECT_TRUE(test::is_slope([&](double h) { return part(exact_step(any_system(h, 2), dt)).value; }, part(here).d(0), 1e-3)) << name;
  };
  check([](const ExactStep& s) { return s.transition; }, "transition");
  check([](const ExactStep& s) { return s.jerk; }, "jerk");
  check([](const ExactStep& s) { return s.input0; }, "input0");
  check([](const ExactStep& s) { return s.input1; }, "input1");
}

TEST(ExactStep, TwoHalfStepsAreOne) {
  const LinearSystem s = any_system(0);
  const ExactStep whole = exact_step(s, 0.5), half = exact_step(s, 0.25);
  EXPECT_LT((half.transition.value * half.transition.value - whole.transition.value).norm(), 1e-14);
  EXPECT_LT((half.transition.value * half.jerk.value + half.jerk.value - whole.jerk.value).norm(), 1e-14);
}

}  // namespace
}  // namespace unrig
