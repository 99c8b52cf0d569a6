#include "fit/fit_files.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <tuple>

#include <nlohmann/json.hpp>

#include "core/files/error.h"
#include "core/law/law_effect.h"
#include "tests/support/sample_data.h"
#include "tests/support/temporary_directory.h"

namespace unrig {
namespace {

using nlohmann::json;

/// A fit with one parameter and an effect, as it stands in its file.
json written(Eigen::Index law_steps) {
  FitResult result;
  result.effects = {"cubic-stiffness"};
  result.law_steps = law_steps;
  result.parameters = {{"cubic-stiffness.coefficient", "1/m^2", "", 40, 1, 1, 1, 0, true, ""}};
  result.correlation = Eigen::MatrixXd::Identity(1, 1);
  return json::parse(to_json(result));
}

FittedRig read_back(const json& fit) {
  const test::TemporaryDirectory directory;
  return read_fit(directory.file("fit.json", fit.dump()));
}

/// A fit with a law whose file says that it was learnt up to 2 m/s; these runs went from -0.3 to 0.28 m/s.
json written_with_law(bool learnt) {
  Rig rig;
  add_law(rig, parse_law("unrig_law = 1\nname = \"drag\"\nacts_on = \"normal\"\nforce = \"-c * abs(v) * v\"\n[parameters]\nc = { start = \"5 N.s^2/m^2\" }\n[learnt_on]\nv = [\"-2 m/s\", \"2 m/s\"]\n", "law.toml"));
  FitResult result;
  result.effects = {"law:drag"};
  if (learnt) result.learnt_on["law:drag"][Symbol::v] = {-0.3, 0.28};
  result.parameters = {{"law:drag.c", "N.s^2/m^2", "", 40, 1, 1, 1, 0, true, ""}};
  result.correlation = Eigen::MatrixXd::Identity(1, 1);
  return json::parse(to_json(result, rig.laws));
}

TEST(FitFiles, SayWhereTheRunsOfTheFitTookALaw) {
  const json fit = written_with_law(true);
  EXPECT_EQ(fit["laws"][0]["learnt_on"], (json{{"v", {-0.3, 0.28, "m/s"}}}));
  const Range here = law_of(*read_back(fit).laws.at(0)).learnt_on.at(Symbol::v), in_file = law_of(*read_back(written_with_law(false)).laws.at(0)).learnt_on.at(Symbol::v);
  EXPECT_EQ(here.lower, -0.3) << "in place of what the law's file says";
  EXPECT_EQ(here.upper, 0.28);
  EXPECT_EQ(in_file.upper, 2) << "a fit of an earlier version";
  for (const auto& [name, range] : {std::pair{"v", json{0.3, -0.3, "m/s"}}, {"w", json{0, 1, "m/s"}}, {"v", json{0, 1, "m"}}, {"v", json{0, 1}}}) {
    json wrong = fit;
    wrong["laws"][0]["learnt_on"] = {{name, range}};
    EXPECT_THROW(read_back(wrong), InputError) << wrong["laws"][0]["learnt_on"];
  }
}

TEST(FitFiles, CarryTheStepsInWhichLawsWereFollowed) {
  EXPECT_EQ(read_back(written(4)).law_steps, 4);
  EXPECT_FALSE(written(1).contains("law_steps")) << "what every fit without strong laws does";
  EXPECT_EQ(read_back(written(1)).law_steps, 1);
  json wrong = written(4);
  wrong["law_steps"] = 0;
  EXPECT_THROW(read_back(wrong), InputError);
}

/// A fit of an earlier version is not taken for one that found nothing.
TEST(FitFiles, AParameterThatAnEffectNoLongerHasIsRefused) {
  FitResult earlier;
  earlier.effects = {"wagner-lag"};
  earlier.parameters = {{"wagner-lag.rate", "1", "", 0.7, 0.02, 0.7, 0.7, 0, true, ""}};
  earlier.correlation = Eigen::MatrixXd::Identity(1, 1);
  try {
    read_back(json::parse(to_json(earlier)));
    FAIL() << "accepted";
  } catch (const InputError& e) {
    EXPECT_THAT(e.what(), testing::HasSubstr("wagner-lag.rate"));
  }
}

TEST(FitFiles, ARunThatWasNotFittedTakesTheSlopeOfTheRunNearestInAngle) {
  FitProblem problem;
  problem.rig = read_rig(test::null_campaign("rig.toml"));
  for (const char* name : {"step_a", "step_b", "step_c"}) problem.runs.push_back(read_run(test::null_campaign(std::string(name) + ".csv")));  // from 2.09, 4 and 25 deg
  const AeroelasticModel model = model_of(problem.rig, problem.runs, problem.circulation, {});
  FittedRig fitted = read_back(json::parse(to_json(fit(problem))));
  const auto slope = [&](double degrees) { return theta_for(model, fitted, "another.csv", degrees * 3.14159265 / 180)[model.index("normal_force_slope")]; };
  const auto own = [&](std::size_t run) { return fitted.value("normal_force_slope", problem.runs[run].file, 0); };
  EXPECT_EQ(slope(2), own(0));
  EXPECT_EQ(slope(5), own(1));
  EXPECT_EQ(slope(22), own(2)) << "in stall";
  fitted.onset_angles.clear();
  EXPECT_NEAR(slope(22), (own(0) + own(1) + own(2)) / 3, 1e-12) << "of an earlier version";
}

/// Three runs of one model, each with a slope of its own; a fourth run that began at 22 degrees was not fitted.
TEST(FitFiles, EveryRunHasItsOwnSlope) {
  const Rig rig = read_rig(test::null_campaign("rig.toml"));
  const AeroelasticModel model(rig, make_basis(rig, Eigen::Index{1}, Eigen::Index{1}), wagner(Wagner::jones));
  FittedRig fit;
  fit.file = "fit.json";
  constexpr double degree = 3.14159265358979 / 180;
  for (const auto& [run, onset, slope] : {std::tuple{"a.csv", 2.0, 5.9}, std::tuple{"b.csv", 4.0, 5.5}, std::tuple{"c.csv", 25.0, 3.6}}) {
    fit.runs.push_back(run);
    fit.onset_angles.push_back(onset * degree);
    fit.parameters.emplace_back();
    fit.parameters.back().name = "normal_force_slope";
    fit.parameters.back().run = run;
    fit.parameters.back().value = slope;
  }
  const auto slope_for = [&](const std::string& run, double degrees) { return theta_for(model, fit, run, degrees * degree)[model.index("normal_force_slope")]; };
  EXPECT_EQ(slope_for("a.csv", 2), 5.9);
  EXPECT_EQ(slope_for("b.csv", 4), 5.5);
  EXPECT_EQ(slope_for("c.csv", 25), 3.6);
  EXPECT_EQ(slope_for("b.csv", 24), 5.5) << "its own, wherever it is said to begin";
  EXPECT_EQ(slope_for("d.csv", 22), 3.6) << "that of the run nearest in angle";
  EXPECT_EQ(slope_for("d.csv", 3.1), 5.5);
  EXPECT_EQ(slope_for("d.csv", 1), 5.9);
  EXPECT_EQ(fit.value("normal_force_slope", "c.csv", 0), 3.6);
  EXPECT_EQ(fit.value("normal_force_slope", "d.csv", -1), -1) << "it has none";
}

TEST(FitFiles, ARecordingIsKnownByItsFileAndByItsNameOnlyWhereThatIsGone) {
  const test::TemporaryDirectory directory;
  std::filesystem::create_directories(directory.path("day1"));
  std::filesystem::create_directories(directory.path("day2"));
  const std::string first = directory.file("day1/step.csv", "1"), second = directory.file("day2/step.csv", "2");
  FittedRig fit;
  fit.file = directory.path("day1/fit.json");
  fit.runs = {first};
  EXPECT_EQ(fit.recorded_as(first), first);
  EXPECT_EQ(fit.recorded_as(directory.path("day1/../day1/step.csv")), first) << "the same file by another path";
  EXPECT_EQ(fit.recorded_as(second), "") << "another recording of that name";
  fit.runs = {"step.csv"};  // as seen from its own folder
  EXPECT_EQ(fit.recorded_as(first), "step.csv");
  EXPECT_EQ(fit.recorded_as(second), "");
  fit.runs = {"elsewhere/day1/step.csv", "elsewhere/day2/step.csv"};  // both have moved
  EXPECT_EQ(fit.recorded_as(second), "elsewhere/day2/step.csv");
  EXPECT_EQ(fit.recorded_as(first), "elsewhere/day1/step.csv");
  EXPECT_EQ(fit.recorded_as(directory.path("day2/other.csv")), "");
}

}  // namespace
}  // namespace unrig
