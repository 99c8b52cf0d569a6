#include "fit/fit_files.h"

#include <gtest/gtest.h>

#include <filesystem>

#include <nlohmann/json.hpp>

#include "core/error.h"
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

TEST(FitFiles, CarryTheStepsInWhichLawsWereFollowed) {
  EXPECT_EQ(read_back(written(4)).law_steps, 4);
  EXPECT_FALSE(written(1).contains("law_steps")) << "what every fit without strong laws does";
  EXPECT_EQ(read_back(written(1)).law_steps, 1);
  json wrong = written(4);
  wrong["law_steps"] = 0;
  EXPECT_THROW(read_back(wrong), InputError);
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
