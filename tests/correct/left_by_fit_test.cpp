#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <numbers>

#include "core/files/error.h"
#include "tests/correct/null_campaign.h"

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

const std::vector<std::string> fitted_runs{"dry_pluck", "wet_pluck", "step_a", "step_b", "step_c"}, steps{"step_a", "step_b", "step_c", "heldout"};

/// A gauge that warms up: its zero goes away exponentially, by another amount in each run. No part of any model that `fit` has without an effect, and no noise of a steady colour.
Run warming(Run run) {
  constexpr double time = 2.5;  // s
  const std::map<std::string, double> size{{"dry_pluck", 0.15}, {"wet_pluck", -0.12}, {"step_a", 0.1}, {"step_b", -0.15}, {"step_c", 0.12}, {"heldout", 0.14}};  // N
  Channel& gauge = *std::find_if(run.channels.begin(), run.channels.end(), [](const Channel& c) { return c.name == "gauge"; });
  for (Index k = 0; k < gauge.value.size(); ++k) gauge.value[k] += size.at(std::filesystem::path(run.file).stem()) * (1 - std::exp(-static_cast<double>(k) * run.dt / time));
  return run;
}

struct Corrected {
  double largest = 0;  ///< error of the circulatory load, r.m.s. of a run over its standard deviations
  bool told = true;    ///< of what the fit left
};

/// The four steps of a campaign, corrected by the fit of its five runs with nothing named that is missing. `with`: whether correct is told what that fit left.
Corrected corrected(const std::string& campaign, Run (*made)(Run), bool with) {
  const auto file = [&](const std::string& name) { return test::source_path("sample_data/campaigns/" + campaign + "/" + name); };
  FitProblem fitted;
  fitted.rig = read_rig(file("rig.toml"));
  for (const std::string& name : fitted_runs) fitted.runs.push_back(made(read_run(file(name + ".csv"))));
  const test::TemporaryDirectory directory;
  FittedRig known = read_fit(directory.file("fit.json", to_json(fit(fitted))));
  EXPECT_FALSE(known.left.empty());
  if (!with) known.left.clear();
  Corrected sum;
  for (const std::string& name : steps) {
    const CorrectResult result = correct({fitted.rig, known, made(read_run(file(name + ".csv"))), 0});
    EXPECT_EQ(result.no_answer, "") << name;
    sum.told &= std::any_of(result.warnings.begin(), result.warnings.end(), [](const std::string& w) { return w.find("would read as a load here") != std::string::npos; });
    const VectorXd truth = test::column_of(file("truth_" + name + ".csv"), "circulatory");
    double squares = 0, samples = 0;
    for (Index k = 0; k < truth.size(); ++k)
      if (const double std = result.circulatory.std[k]; std > 0) squares += std::pow((result.circulatory.value[k] - truth[k]) / std, 2), ++samples;
    sum.largest = std::max(sum.largest, std::sqrt(squares / samples));
  }
  return sum;
}

Run as_it_is(Run run) { return run; }

/// A drift reads as a load, and a step by itself is explained. The decays show how the zero changes within a record, not where it was before: hence more than the three standard deviations of one Gaussian error.
TEST(LeftByFit, IsInTheBandOfAGaugeThatWarmsUp) {
  const Corrected without = corrected("null", warming, false), with = corrected("null", warming, true);
  EXPECT_GT(without.largest, 15);
  EXPECT_FALSE(without.told);
  EXPECT_LT(with.largest, 5);
  EXPECT_TRUE(with.told);
}

/// Errors of a run are one error: a Gaussian one beyond three of its standard deviations happens once in 370.
TEST(LeftByFit, IsInTheBandOfSteppingInAWave) {
  const Corrected without = corrected("wave", as_it_is, false), with = corrected("wave", as_it_is, true);
  EXPECT_GT(without.largest, 4);
  EXPECT_LT(with.largest, 3);
  EXPECT_TRUE(with.told);
}

/// What is left of wide swings may be more than all of a step's load. Whether an unexplained step has an answer is for its own readings to say.
TEST(LeftByFit, DoesNotDecideWhetherThereIsAnAnswer) {
  CorrectProblem problem = test::null_problem("step_a");
  Channel& gauge = *std::find_if(problem.run.channels.begin(), problem.run.channels.end(), [](const Channel& c) { return c.name == "gauge"; });
  for (Index k = 0; k < gauge.value.size(); ++k) gauge.value[k] += 0.1 * std::sin(2 * std::numbers::pi * 1.7 * static_cast<double>(k) * problem.run.dt);  // N
  problem.fit.left = {{"dry_pluck.csv", "gauge", false, {0.3, VectorXd::Constant(10, 30.0)}}};
  const CorrectResult result = correct(problem);
  EXPECT_GT(result.reduced_chi2, 2);
  EXPECT_GT(result.circulatory.std.tail(100).mean(), std::abs(result.circulatory.value.tail(1)[0] - result.circulatory.value[0]));
  EXPECT_EQ(result.no_answer, "");
}

/// A load that builds up otherwise than the fit has it is an answer and no disturbance.
TEST(LeftByFit, DoesNotWidenWhatTheStepsThemselvesExplain) {
  FittedRig known = test::null_fit();
  const CorrectProblem problem = test::null_problem("step_a");
  const CorrectResult plain = correct(problem);
  known.left = {{"step_b.csv", "gauge", true, {0.3, VectorXd::Constant(10, 1.0)}}};
  const CorrectResult same = correct({problem.rig, known, problem.run, 0});
  EXPECT_EQ(same.circulatory.std, plain.circulatory.std);
  EXPECT_EQ(same.warnings, plain.warnings);
}

TEST(LeftByFit, IsNothingOfRunsThatAreExplained) { EXPECT_TRUE(test::null_fit().left.empty()); }

FittedRig fit_with(const std::string& channel) {
  const test::TemporaryDirectory directory;
  return read_fit(directory.file("fit.json", R"({"unrig": "fit", "parameters": [], "runs": [{"file": "a.csv", "in_stream": true, "channels": [{"name": "gauge"}, {"name": "tip", )" + channel + "}]}]}"));
}

TEST(LeftByFit, IsReadAsItIsWritten) {
  const FittedRig fit = fit_with(R"("left": {"from": 0.25, "unit": "Hz", "density": [1, 0, 3]})");
  ASSERT_EQ(fit.left.size(), 1u);
  EXPECT_EQ(fit.left[0].run, "a.csv");
  EXPECT_EQ(fit.left[0].channel, "tip");
  EXPECT_TRUE(fit.left[0].in_stream);
  EXPECT_EQ(fit.left[0].power.from, 0.25);
  EXPECT_EQ(fit.left[0].power.density, VectorXd({{1, 0, 3}}));
  EXPECT_TRUE(fit_with(R"("unit": "m")").left.empty());  // as an earlier version wrote it
}

TEST(LeftByFit, IsRefusedWhereItIsNoPower) {
  for (const std::string left : {R"({"from": 0, "density": [1]})", R"({"from": 0.25, "density": [1, -1]})", R"({"from": 0.25, "density": [null]})", R"({"density": [1]})"}) EXPECT_THROW(fit_with("\"left\": " + left), InputError) << left;
}

}  // namespace
}  // namespace unrig
