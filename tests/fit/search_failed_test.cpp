// A search that lost its way says so: "unexplained" after it and after a thorough one are two answers.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "fit/diagnose/diagnosis_files.h"
#include "fit/diagnose/selection.h"
#include "fit/uncertainty/out_of_proportion.h"
#include "tests/support/sample_data.h"

namespace unrig {
namespace {

using nlohmann::json;
using ::testing::HasSubstr;
using ::testing::Not;

/// A trial that leaves so many times its noise power of two runs of a thousand samples each.
Trial leaving(const Trial& like, std::vector<std::string> effects, double power) {
  Trial trial = like;
  trial.effects = std::move(effects);
  trial.variance = {power, power};
  trial.samples = {1000, 1000};
  trial.angle_variance = {1, 1};
  trial.angle_samples = {0, 0};
  trial.variables = 10 + static_cast<int>(trial.effects.size());
  return trial;
}

Trial two_runs() {
  static const FitProblem problem = [] {  // the trial refers to its runs
    FitProblem of_two;
    of_two.rig = read_rig(test::null_campaign("rig.toml"));
    for (const char* run : {"dry_pluck", "wet_pluck"}) of_two.runs.push_back(read_run(test::null_campaign(std::string(run) + ".csv")));
    return of_two;
  }();
  return fit_baseline(problem);
}

TEST(SearchFailed, OneEffectMoreCannotLeaveMore) {
  const Trial any = two_runs(), base = leaving(any, {}, 7.8e4);
  EXPECT_EQ(search_of(leaving(any, {"cubic-stiffness"}, 7e18), base), SearchOutcome::failed);
  EXPECT_EQ(search_of(leaving(any, {"cubic-stiffness"}, 7.7e4), base), SearchOutcome::complete);
  EXPECT_EQ(search_of(leaving(any, {"cubic-stiffness"}, 7.8e4), base), SearchOutcome::complete) << "an effect of no size";
  // -2 ln L = 2000 ln of the ratio: 10 of it is half a per cent of the power.
  EXPECT_EQ(search_of(leaving(any, {"cubic-stiffness"}, 7.8e4 * 1.004), base), SearchOutcome::complete);
  EXPECT_EQ(search_of(leaving(any, {"cubic-stiffness"}, 7.8e4 * 1.006), base), SearchOutcome::failed);
  EXPECT_EQ(search_of(leaving(any, {"higher-mode"}, 7e18), base), SearchOutcome::complete) << "all the modes are no more than some of them and a number";
  Trial told = leaving(any, {"freeplay"}, 7e18);
  told.ruled_out = true;
  EXPECT_EQ(search_of(told, base), SearchOutcome::ruled_out);
}

TEST(SearchFailed, BicIsTheLikelihoodAndWhatVariablesCost) {
  const Trial any = two_runs(), base = leaving(any, {}, 3), other = leaving(any, {"cubic-stiffness"}, 2);
  EXPECT_NEAR(deviance_difference(other, base), 2000 * std::log(2.0 / 3), 1e-9);
  EXPECT_NEAR(bic_difference(other, base), 2000 * std::log(2.0 / 3) + std::log(2000.0), 1e-9);
}

Diagnosis unexplained(SearchOutcome search, std::vector<std::vector<std::string>> not_followed) {
  Diagnosis d;
  d.mismatch.found = d.unexplained = true;
  d.search = search;
  d.not_followed = std::move(not_followed);
  d.ranking = {{{}, 7.8e4, 0, 1, 0, SearchOutcome::complete}, {{"freeplay"}, 7e18, 1e5, 0, 0, search}};
  return d;
}

TEST(SearchFailed, TheDiagnosisSaysWhatFailed) {
  const Diagnosis thorough = unexplained(SearchOutcome::complete, {}), lost = unexplained(SearchOutcome::failed, {{}, {"freeplay"}, {"tank-wave", "freeplay"}});
  const json complete = json::parse(to_json(thorough)), failed = json::parse(to_json(lost));
  EXPECT_EQ(complete["search"], "complete");
  EXPECT_EQ(complete["search_summary"], "");
  EXPECT_EQ(complete["unexplained"], true);
  EXPECT_EQ(failed["search"], "failed");
  EXPECT_EQ(failed["not_followed"], json::parse(R"([[], ["freeplay"], ["tank-wave", "freeplay"]])"));
  EXPECT_EQ(failed["ranking"][1]["search"], "failed");
  EXPECT_NE(failed["verdict"], complete["verdict"]);
  EXPECT_THAT(failed["verdict"].get<std::string>(), HasSubstr("unexplained"));
  EXPECT_THAT(report(lost), HasSubstr("With freeplay; tank-wave + freeplay added the search ended with more left than without"));
  EXPECT_THAT(report(lost), HasSubstr("The rig with nothing added was searched from a fit that leaves far more"));
  EXPECT_THAT(report(lost), HasSubstr("the search lost its way: no verdict on this set"));
  EXPECT_THAT(report(thorough), Not(HasSubstr("lost its way")));
}

TEST(OutOfProportion, AParticipationOfAMillionModalMassesGetsAWord) {
  std::vector<FittedParameter> parameters(4);
  for (std::size_t k = 0; k < parameters.size(); ++k) {
    parameters[k].mode = static_cast<int>(k / 2);
    parameters[k].role = k % 2 == 0 ? Role::mass : Role::load;
  }
  parameters[0].name = "modal[1].mass";
  parameters[0].value = 2;
  parameters[1].name = "modal[1].mount_participation";
  parameters[1].value = -2.2e6;
  parameters[1].std_error = 3e4;
  parameters[2].name = "modal[2].mass";
  parameters[2].value = 2;
  parameters[3].name = "modal[2].mount_participation";
  parameters[3].value = 3.1;
  parameters[3].std_error = std::nan("");  // held
  const std::vector<std::string> told = out_of_proportion(parameters);
  ASSERT_EQ(told.size(), 1u);
  EXPECT_THAT(told[0], HasSubstr("modal[1].mount_participation = -2.2e+06 kg is 1.1e+06 times the mass of its mode"));
  parameters[1].std_error = 3e6;
  EXPECT_TRUE(out_of_proportion(parameters).empty()) << "it may well be none: what is not known is no oddity";
}

}  // namespace
}  // namespace unrig
