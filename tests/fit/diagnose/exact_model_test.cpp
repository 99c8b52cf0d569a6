#include "fit/diagnose/exact_model.h"

#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <numbers>

#include "core/law/law_effect.h"
#include "tests/fit/one_mode.h"

namespace unrig {
namespace {

constexpr double noise = 0.002, omega = 2 * std::numbers::pi * one_mode::hertz, drag = 0.02;

/// x'' + 2 zeta omega x' + omega^2 x = -drag |x'| x', by the semi-implicit method of Euler in a hundred steps a sample.
Run decay(const char* name, double start, unsigned seed) {
  constexpr Eigen::Index samples = 600;
  constexpr int finer = 100;
  const double h = one_mode::dt / finer;
  Eigen::VectorXd reading(samples);
  double x = start, v = 0;
  for (Eigen::Index k = 0; k < samples; ++k) {
    reading[k] = x;
    for (int i = 0; i < finer; ++i) {
      v -= h * (2 * one_mode::damping_ratio * omega * v + omega * omega * x + drag * std::abs(v) * v);
      x += h * v;
    }
  }
  return one_mode::decay(name, reading + noise * one_mode::white_noise(samples, seed));
}

TEST(ExactModel, LeavesTheNoiseAndIsAheadOfNothing) {
  FitProblem problem;
  problem.rig = one_mode::rig();
  problem.runs = {decay("large.csv", 1, 3), decay("small.csv", -0.6, 4)};
  const Law law = parse_law("unrig_law = 1\nname = \"drag\"\nacts_on = \"normal\"\nforce = \"-c * abs(v) * v\"\n[parameters]\nc = { start = \"0.02 N.s^2/m^2\", lower = \"0 N.s^2/m^2\" }\n", "drag");
  const HiddenLaw hidden{law_effect(law), {{"law:drag.c", drag}}};
  const Trial base = fit_baseline(problem);
  ASSERT_GT(base.reduced_chi2(), 2);
  ExactModel exact(hidden, problem, base);
  const std::vector<unrig::Run> unseen{decay("unseen.csv", 0.8, 5)};
  const AgainstTruth told = exact.told(unseen);
  EXPECT_NEAR(told.reduced_chi2, 1, 0.15) << "chi-square of 1200 readings scatters by 4 %, their noise level by some";
  ASSERT_EQ(told.behind.size(), 1u);
  EXPECT_TRUE(told.behind.front().first.empty());
  const double samples = 1200;
  EXPECT_NEAR(told.behind.front().second / (samples * std::log(base.reduced_chi2() / told.reduced_chi2)), 1, 0.3) << "two runs, each with its own variance";
  ASSERT_EQ(told.heldout.size(), 1u);
  EXPECT_NEAR(told.heldout.front(), noise, 0.15 * noise);
}

}  // namespace
}  // namespace unrig
