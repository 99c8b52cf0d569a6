// What keeps the best set of effects from being named. A rig of one mode whose spring hardens, integrated step by step; what is hidden beside that has no name among the candidates.

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "fit/diagnose/diagnose.h"
#include "tests/fit/one_mode.h"

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

constexpr Index samples = 400;
constexpr double noise = 0.01;

/// With a spring that hardens by k_3 q^3; 10 steps a sample leave 1e-9 of it.
VectorXd hardening_decay(double start, double k3) {
  return one_mode::decay_beside([&](double q, double) { return k3 * q * q * q; }, start, samples, 10);
}

/// What a spring without hardening does that many times the rig's frequency.
VectorXd linear_decay(double start, double faster) { return start * one_mode::free_response(samples, faster * one_mode::hertz).col(0); }

unrig::Run recorded(const std::string& file, const VectorXd& reading, unsigned seed) { return one_mode::decay(file, reading + noise * one_mode::white_noise(samples, seed)); }

constexpr double hardening = 12;  // N/m^3: at 3 m a twentieth of the spring, which leaves a linear rig ten times the noise

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

/// It explains what was fitted to the noise. The run that was held out swings by so little that it would hardly feel the hardening, and faster all the same: as fast as the fitted decays do by and large
/// (3/8 k_3 a^2 / omega^2 at an amplitude a, whose square is half of the first in the mean over the power of a decay), so that without the effect it is predicted well.
TEST(Naming, NotOneThatRunsThatWereNotFittedAreWorsePredictedWith) {
  DiagnoseProblem problem = two_decays(0);
  const double omega = 2 * std::numbers::pi * one_mode::hertz, faster = 3.0 / 8 * hardening * (3 * 3 / 2.0) / (omega * omega);
  problem.heldout = {recorded("another_spring.csv", linear_decay(0.5, 1 + faster), 3)};
  const Diagnosis d = diagnose(problem);
  EXPECT_FALSE(d.remaining.found) << "otherwise something else speaks against it";
  EXPECT_EQ(d.naming, Naming::does_not_predict);
  EXPECT_TRUE(d.missing.empty());
  EXPECT_EQ(ids(d.closest), Strings{"cubic-stiffness"});
  EXPECT_TRUE(d.unexplained);
}

/// The run that was held out hardly feels the hardening: whether it is left with more or with less than before is chance, which speaks against nothing.
TEST(Naming, AnEffectThatRunsThatWereNotFittedHardlyFeel) {
  int worse = 0;
  for (const unsigned seed : {3u, 4u, 5u, 6u}) {
    DiagnoseProblem problem = two_decays(0);
    problem.heldout = {recorded("hardly_moved.csv", hardening_decay(noise / 2, hardening), seed)};
    const Diagnosis d = diagnose(problem);
    EXPECT_EQ(ids(d.missing), Strings{"cubic-stiffness"}) << seed;
    for (const ImprovedRun& run : d.runs)
      if (run.heldout && run.rms_after > run.rms_before) ++worse;
  }
  EXPECT_GT(worse, 0) << "otherwise this tests nothing";
}

/// A tone that no candidate has leaves a mismatch. Where that is less than three hundredths of the excess the spring is named all the same, and the rest is said to be unexplained; where it is more it is not.
TEST(Naming, NotOneThatLeavesMoreThanAFewPerCentOfTheExcess) {
  for (const double tone : {0.02, 0.04}) {
    DiagnoseProblem problem = two_decays(tone);
    problem.verdict_only = true;
    const Diagnosis d = diagnose(problem);
    EXPECT_TRUE(d.remaining.found);
    EXPECT_TRUE(d.unexplained);
    // The power of the tone over that of the noise is what the best set is left with, and the excess of the fit without it is all that.
    const double left = tone * tone / 2 / (noise * noise);
    double before = 0;
    for (const Candidate& c : d.ranking)
      if (c.effects.empty()) before = c.reduced_chi2 - 1;
    if (tone < 0.03) {
      ASSERT_LT(left, (1 - enough_to_name) * before);
      EXPECT_EQ(ids(d.missing), Strings{"cubic-stiffness"});
      continue;
    }
    ASSERT_GT(left, (1 - enough_to_name) * before);
    EXPECT_EQ(d.naming, Naming::removes_too_little);
    EXPECT_TRUE(d.missing.empty());
    EXPECT_EQ(ids(d.closest), Strings{"cubic-stiffness"});
    EXPECT_NEAR(d.removed_by_closest, 1 - left / before, 0.03);
  }
}

}  // namespace
}  // namespace unrig
