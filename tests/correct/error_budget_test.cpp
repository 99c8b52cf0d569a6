#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <stdexcept>

#include "core/files/csv_table.h"
#include "correct/corrected_files.h"
#include "correct/estimate/uncertainty_budget.h"
#include "fit/givens/fitted_numbers.h"
#include "tests/correct/null_campaign.h"
#include "tests/support/stated.h"

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

Index place(const std::string& share) { return std::find(share_names.begin(), share_names.end(), share) - share_names.begin(); }

/// The variance that a source accounts for, over the record [N^2].
VectorXd variance_of(const CorrectedLoad& load, const std::string& share) {
  return variance_shares(load.by_source, load.of_givens).col(place(share)).cwiseProduct(load.std.cwiseAbs2());
}

/// The campaign fitted with masses that are known to one per cent each, and a run that took no part in it.
CorrectProblem problem_with_givens(const test::TemporaryDirectory& directory) {
  FitProblem problem;
  directory.file("rig.toml", test::with_line(read_text(test::null_campaign("rig.toml")), "mass.unit", "mass.std_percent = 1.0"));
  problem.rig = read_rig(directory.path("rig.toml"));
  for (const std::string run : {"dry_pluck", "wet_pluck", "step_a", "step_b", "step_c"})
    problem.runs.push_back(read_run(test::null_campaign(run + ".csv")));
  const FittedRig fitted = read_fit(directory.file("fit.json", to_json(fit(problem))));
  return {problem.rig, fitted, read_run(test::null_campaign("heldout.csv")), 0.01};
}

TEST(ErrorBudget, SharesInTheTableSumToOneAndMakeTheStatedDeviations) {
  const test::TemporaryDirectory directory;
  const CorrectResult result = correct(problem_with_givens(directory));
  const CsvTable table = read_csv(to_csv(result), 1, "corrected.csv");
  const auto column = [&](const std::string& name) -> const VectorXd& {
    for (const CsvColumn& c : table.columns)
      if (c.name == name) return c.value;
    throw std::out_of_range(name);
  };
  for (const std::string load : {"circulatory", "normal_force"}) {
    const VectorXd variance = column(load + "_std").cwiseAbs2();
    VectorXd sum = VectorXd::Zero(variance.size()), of_rig = sum;
    for (const std::string share : share_names) {
      const VectorXd& here = column(load + "_share_" + share);
      EXPECT_GE(here.minCoeff(), 0) << share;
      EXPECT_GT(here.maxCoeff(), 0) << share << ": every source is at work here";
      sum += here;
      if (share == "parameters" || share == "givens") {
        of_rig += here.cwiseProduct(variance);
        continue;
      }
      // Three digits of the part, four of the whole, six decimals of the share.
      const VectorXd stated = column(load + "_std_" + share).cwiseAbs2(),
                     off = (here.cwiseProduct(variance) - stated).cwiseAbs() - (0.02 * stated + 1e-6 * variance);
      EXPECT_LE(off.maxCoeff(), 0) << share;
    }
    EXPECT_LT((sum.array() - 1).abs().maxCoeff(), 6 * 0.5e-6 + 1e-12) << "rounded to six decimals each";
    const VectorXd stated = column(load + "_std_rig").cwiseAbs2(), off = (of_rig - stated).cwiseAbs() - (0.02 * stated + 2e-6 * variance);
    EXPECT_LE(off.maxCoeff(), 0) << "both parts of the rig's";
  }
}

/// A source that is switched off takes its share of the variance away, and nothing else.
TEST(ErrorBudget, WhatIsSwitchedOffIsWhatIsMissing) {
  const test::TemporaryDirectory directory;
  const CorrectProblem problem = problem_with_givens(directory);
  const CorrectResult all = correct(problem);

  CorrectProblem exact_gauge = problem;
  exact_gauge.calibration_uncertainty = 0;
  const CorrectResult without_calibration = correct(exact_gauge);

  const FittedNumbers numbers(problem.fit, problem.rig, problem.run);
  CorrectProblem known = problem;  // masses as the fit has them, and exact
  known.rig = numbers.rig();
  known.rig.givens = nullptr;
  known.run = numbers.run();
  known.run.givens = nullptr;
  known.fit = numbers.with_numbers_known();
  known.fit.givens.clear();
  known.fit.joint_covariance.resize(0, 0);
  known.fit.rig_fingerprint.clear();
  known.fit.fingerprints.clear();
  const CorrectResult without_givens = correct(known);
  EXPECT_EQ(without_givens.circulatory.of_givens.size(), 0);

  for (const auto load : {&CorrectResult::circulatory, &CorrectResult::normal_force}) {
    const VectorXd whole = (all.*load).std.cwiseAbs2();
    const auto off = [&](const CorrectResult& without, const std::string& share) {
      return ((whole - (without.*load).std.cwiseAbs2() - variance_of(all.*load, share)).cwiseQuotient(whole)).cwiseAbs().maxCoeff();
    };
    EXPECT_LT(off(without_calibration, "calibration"), 1e-9);
    EXPECT_LT(off(without_givens, "givens"), 1e-9);
  }
}

/// The load of recordings that differ in the noise of one channel alone scatters as its share says.
TEST(ErrorBudget, LoadScattersAsTheShareOfAChannelsNoiseSays) {
  CorrectProblem problem = test::null_problem("heldout");
  const CorrectResult once = correct(problem);
  const VectorXd gauge = once.gauge - once.unexplained;  // without noise, under the motion of the recording
  constexpr int draws = 30;
  std::mt19937_64 random(29);
  std::normal_distribution<double> normal;
  const Index n = gauge.size();
  VectorXd sum = VectorXd::Zero(n), squares = sum, expected = sum;
  for (int d = 0; d < draws; ++d) {
    for (Channel& channel : problem.run.channels)
      if (channel.name == "gauge") channel.value = gauge + once.noise * VectorXd::NullaryExpr(n, [&] { return normal(random); });
    const CorrectResult drawn = correct(problem);
    sum += drawn.circulatory.value;
    squares += drawn.circulatory.value.cwiseAbs2();
    expected += variance_of(drawn.circulatory, "gauge") / draws;
  }
  const VectorXd scatter = (squares - sum.cwiseAbs2() / draws) / (draws - 1);
  // Before, just behind and long behind the step. A variance of 30 draws scatters by 26 %; three of them, hardly correlated, by 15 %: three
  // times that either way.
  double ratio = 0;
  for (const Index k : {Index{100}, Index{700}, Index{2500}}) {
    ratio += scatter[k] / expected[k] / 3;
    EXPECT_GT(scatter[k] / expected[k], 0.35) << k;  // chi-square of 29 degrees of freedom: one in ten thousand beyond either
    EXPECT_LT(scatter[k] / expected[k], 2.2) << k;
  }
  EXPECT_NEAR(ratio, 1, 0.45);
}

}  // namespace
}  // namespace unrig
