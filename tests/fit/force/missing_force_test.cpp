#include "fit/force/missing_force.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "core/propagate/exact_step.h"
#include "fit/search/effect_search.h"

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

constexpr double dt = 0.002, frequency = 3, damping = 0.02, mass = 1.5;
constexpr double omega = 2 * std::numbers::pi * frequency;

/// m q'' + c q' + k q = f; the gauge reads k q.
LinearSystem oscillator() {
  LinearSystem s;
  s.A.value = (Eigen::Matrix2d() << 0, 1, -omega * omega, -2 * damping * omega).finished();
  s.B.value = Eigen::Vector2d(0, 1 / mass);
  s.C.value = Eigen::RowVector2d(mass * omega * omega, 0);
  s.D.value = Eigen::MatrixXd::Zero(1, 1);
  s.coordinates = 1;
  return s;
}

/// The reading by Runge and Kutta's method over twenty steps per sample, from rest.
template <class Force>
VectorXd reading(Index samples, Force force) {
  constexpr int finer = 20;
  const double h = dt / finer;
  Eigen::Vector2d x(0, 0);
  VectorXd y(samples);
  const auto slope = [&](const Eigen::Vector2d& at, double t) { return Eigen::Vector2d(at[1], force(t) / mass - omega * omega * at[0] - 2 * damping * omega * at[1]); };
  for (Index k = 0; k < samples; ++k) {
    y[k] = mass * omega * omega * x[0];
    for (int i = 0; i < finer; ++i) {
      const double t = dt * static_cast<double>(k) + h * i;
      const Eigen::Vector2d a = slope(x, t), b = slope(x + h / 2 * a, t + h / 2), c = slope(x + h / 2 * b, t + h / 2), d = slope(x + h * c, t + h);
      x += h / 6 * (a + 2 * b + 2 * c + d);
    }
  }
  return y;
}

VectorXd white(Index samples, double sigma, unsigned seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal(0, sigma);
  return VectorXd::NullaryExpr(samples, [&] { return normal(random); });
}

/// Two pushes of 2 N for 0.3 s that the rig's ringing hides in the reading.
TEST(MissingForce, FindsPushesAtTheirTime) {
  constexpr Index samples = 2000;
  constexpr double noise = 0.02;
  const auto push = [](double t) {
    double f = 0;
    for (const double begin : {0.8, 2.1}) f += t > begin && t < begin + 0.3 ? 2 * std::pow(std::sin(std::numbers::pi * (t - begin) / 0.3), 2) : 0;
    return f;
  };
  VectorXd residual = reading(samples, push) + white(samples, noise, 4);
  residual.segment(600, 5).setConstant(std::nan(""));  // a gap
  const MissingForce found = estimate_force(oscillator(), dt, residual, noise);
  VectorXd truth(samples);
  for (Index k = 0; k < samples; ++k) truth[k] = push(dt * static_cast<double>(k));
  EXPECT_GT((residual.array().isFinite().select(residual, 0.0) - truth).norm() / truth.norm(), 1) << "the reading itself is no answer";
  EXPECT_LT((found.value - truth).norm() / std::sqrt(static_cast<double>(samples)), found.standard_deviation) << "most of the time there is no push, and then less is wrong than the band allows for";
  Index peak = 0;
  found.value.head(800).maxCoeff(&peak);
  EXPECT_NEAR(dt * static_cast<double>(peak), 0.95, 0.02) << "the crest is flat: within 0.02 s the push is 4 % of itself below it";
}

/// Where the force is what the method takes it for, the band holds what it says: 95 % within two standard deviations. A walk of 20 s at 500 Hz has some hundred
/// independent stretches, five of them five hundred: the share scatters by one per cent.
TEST(MissingForce, BandHolds) {
  constexpr Index samples = 10000;
  constexpr double noise = 0.05, roughness = 3;
  double inside = 0, count = 0, estimated = 0;
  for (unsigned seed = 1; seed <= 5; ++seed) {
    const VectorXd steps = white(samples + 1, roughness * std::sqrt(dt), 100 + seed);
    VectorXd force = VectorXd::Zero(samples + 2);
    for (Index k = 0; k <= samples; ++k) force[k + 1] = force[k] + steps[k];
    const auto between = [&](double t) {
      const double at = t / dt;
      const Index k = std::min<Index>(static_cast<Index>(at), samples);
      return force[k] + (at - static_cast<double>(k)) * (force[k + 1] - force[k]);
    };
    const MissingForce found = estimate_force(oscillator(), dt, reading(samples, between) + white(samples, noise, seed), noise);
    estimated += found.roughness / 5;
    for (Index k = 200; k < samples - 200; ++k) {
      inside += std::abs(found.value[k] - force[k]) < 1.96 * found.standard_deviation ? 1 : 0;
      ++count;
    }
  }
  EXPECT_NEAR(inside / count, 0.95, 0.03) << "three times that scatter";
  EXPECT_NEAR(estimated, roughness, 0.1 * roughness) << "five hundred stretches tell a variance to 6 %, its root to 3 %: three times that";
}

/// White noise holds no force: what is found is far below what the rig would need to read the noise.
TEST(MissingForce, NothingWhereThereIsNothing) {
  constexpr double noise = 0.05;
  const MissingForce found = estimate_force(oscillator(), dt, white(3000, noise, 9), noise);
  EXPECT_LT(found.value.norm() / std::sqrt(3000.0), 3 * found.standard_deviation);
  EXPECT_LT(found.standard_deviation, 0.1 * noise) << "as well as the mean of a hundred of the three thousand samples";
}

TEST(MissingForce, LargerThanAllThatWasReadIsOutOfProportion) {
  MissingForce force;
  force.value = VectorXd::Constant(10, -277);
  force.as_read = 35;
  EXPECT_DOUBLE_EQ(force.rms(), 277);
  EXPECT_TRUE(force.out_of_proportion());
  force.as_read = 300;
  EXPECT_FALSE(force.out_of_proportion());
  force.as_read = 0;  // a gauge that no steady force moves
  EXPECT_FALSE(force.out_of_proportion());
}

/// A line far above the rig's resonance, a few per cent of the whole reading: as a force it is seventy times what it reads, since the rig answers by (f0/f)^2.
TEST(MissingForce, OfALineThatTheRigCannotAnswerIsOutOfProportion) {
  const Rig rig = [] {
    Rig r;
    r.modal.push_back({mass, frequency, damping, mass * omega * omega, "N", {}});
    return r;
  }();
  unrig::Run run;
  run.file = "decay.csv";
  run.kind = RunKind::pluck;
  run.density = 1.2;
  run.dt = dt;
  constexpr Index samples = 2000;
  constexpr double line = 25;  // Hz
  const VectorXd noise = white(samples, 0.002, 3);
  VectorXd gauge(samples);
  for (Index k = 0; k < samples; ++k) {
    const double t = dt * static_cast<double>(k);
    gauge[k] = 10 * std::exp(-damping * omega * t) * std::cos(omega * std::sqrt(1 - damping * damping) * t) + 0.15 * std::sin(2 * std::numbers::pi * line * t) + noise[k];
  }
  run.channels.push_back({"gauge", "N", "N", 1, gauge});
  FitProblem problem;
  problem.rig = rig;
  problem.runs = {run};
  const std::vector<MissingForce> forces = missing_forces(fit_baseline(problem).arrival.joint);
  ASSERT_EQ(forces.size(), 1u);
  const double swing = std::sqrt((gauge.array() - gauge.mean()).square().mean());
  EXPECT_NEAR(forces[0].as_read / swing, 1, 0.02) << "this gauge reads a steady force as it is";
  EXPECT_GT(forces[0].rms(), swing);
  EXPECT_TRUE(forces[0].out_of_proportion());
}

}  // namespace
}  // namespace unrig
