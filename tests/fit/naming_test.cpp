// What keeps the best set of effects from being named. A rig of one mode whose spring hardens, integrated step by step; what is hidden beside that has no name among the candidates.

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <string>

#include "fit/diagnose/diagnose.h"
#include "tests/fit/one_mode.h"

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

constexpr Index samples = 400;
constexpr double noise = 0.01;

/// q'' + 2 zeta omega q' + omega^2 q + k_3 q^3 = 0 from q = `start` on, by Runge and Kutta's rule: 10 steps a sample leave 1e-9 of it.
VectorXd hardening_decay(double start, double k3) {
  constexpr int steps = 10;
  const double omega = 2 * std::numbers::pi * one_mode::hertz, h = one_mode::dt / steps;
  const auto slope = [&](const Eigen::Vector2d& x) { return Eigen::Vector2d(x[1], -2 * one_mode::damping_ratio * omega * x[1] - omega * omega * x[0] - k3 * x[0] * x[0] * x[0]); };
  Eigen::Vector2d x(start, 0);
  VectorXd q(samples);
  for (Index k = 0; k < samples; ++k) {
    q[k] = x[0];
    for (int i = 0; i < steps; ++i) {
      const Eigen::Vector2d a = slope(x), b = slope(x + h / 2 * a), c = slope(x + h / 2 * b), d = slope(x + h * c);
      x += h / 6 * (a + 2 * b + 2 * c + d);
    }
  }
  return q;
}

unrig::Run recorded(const std::string& file, const VectorXd& reading, unsigned seed) { return one_mode::decay(file, reading + noise * one_mode::white_noise(samples, seed)); }

constexpr double hardening = 3;  // N/m^3: at 3 m a seventieth of the spring, and thirty times the noise within a second

DiagnoseProblem two_decays(double tone) {
  DiagnoseProblem problem;
  problem.rig = one_mode::rig();
  problem.effects = {"cubic-stiffness"};
  const VectorXd beside = tone * one_mode::tone(samples, 23);
  problem.runs = {recorded("large.csv", hardening_decay(3, hardening) + beside, 1), recorded("small.csv", hardening_decay(1.5, hardening) + beside, 2)};
  return problem;
}

std::vector<std::string> ids(const std::vector<MissingEffect>& effects) {
  std::vector<std::string> all;
  for (const MissingEffect& e : effects) all.push_back(e.effect);
  return all;
}

using Strings = std::vector<std::string>;

TEST(Naming, AnEffectThatRunsOfTheSameRigAreBetterPredictedWith) {
  DiagnoseProblem problem = two_decays(0);
  problem.heldout = {recorded("another.csv", hardening_decay(2.5, hardening), 3)};
  const Diagnosis d = diagnose(problem);
  EXPECT_EQ(ids(d.missing), Strings{"cubic-stiffness"});
  EXPECT_FALSE(d.unexplained);
}

/// It explains what was fitted to the noise. The run that was held out is from before the spring hardened.
TEST(Naming, NotOneThatRunsThatWereNotFittedAreWorsePredictedWith) {
  DiagnoseProblem problem = two_decays(0);
  problem.heldout = {recorded("before.csv", hardening_decay(2.5, 0), 3)};
  const Diagnosis d = diagnose(problem);
  EXPECT_FALSE(d.remaining.found) << "otherwise something else speaks against it";
  EXPECT_EQ(d.naming, Naming::does_not_predict);
  EXPECT_TRUE(d.missing.empty());
  EXPECT_EQ(ids(d.closest), Strings{"cubic-stiffness"});
  EXPECT_TRUE(d.unexplained);
}

/// A tone that no candidate has leaves a tenth of the excess, and more: most is gone, and the spring is not named.
TEST(Naming, NotOneThatLeavesMoreThanAFewPerCentOfTheExcess) {
  DiagnoseProblem problem = two_decays(0.15);
  problem.verdict_only = true;
  const Diagnosis d = diagnose(problem);
  EXPECT_GT(d.removed_by_closest, 0.5) << "otherwise it would not be worth a name anyway";
  EXPECT_LT(d.removed_by_closest, 0.95) << "otherwise it is nearly enough";
  EXPECT_EQ(d.naming, Naming::removes_too_little);
  EXPECT_TRUE(d.missing.empty());
  EXPECT_EQ(ids(d.closest), Strings{"cubic-stiffness"});
  EXPECT_TRUE(d.unexplained);
}

}  // namespace
}  // namespace unrig
