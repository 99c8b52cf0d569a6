#include "fit/diagnose/trial.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "core/error.h"
#include "fit/diagnose/trial_campaign.h"
#include "tests/support/sample_data.h"

namespace unrig {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;

TEST(TrialCampaign, HidesWhatItSaysAndRepeats) {
  const Rig rig = read_rig(test::null_campaign("rig.toml"));
  const auto draw = [&](const std::vector<std::string>& hidden) {
    std::mt19937_64 random(7);
    return draw_campaign(rig, hidden, 0.03, random);
  };
  const TrialCampaign null = draw({}), wave = draw({"tank-wave"});
  EXPECT_EQ(null.size, 0);
  EXPECT_GT(wave.size, 0.199) << "the least r.m.s. that is drawn, 0.2 of the noise";
  EXPECT_LT(wave.size, 20.01);
  ASSERT_EQ(wave.runs.size(), 5u);
  EXPECT_EQ(wave.runs[0].dt, 0.002);
  EXPECT_EQ(wave.runs[0].samples(), 2500);
  EXPECT_EQ(wave.runs[4].samples(), 3000);
  EXPECT_NEAR(wave.runs[4].channel("alpha").value[0], 25 * 3.14159265 / 180, 5 * 1.8e-4) << "five times the noise of the angle";
  EXPECT_EQ(draw({"tank-wave"}).runs[3].channel("gauge").value, wave.runs[3].channel("gauge").value);
}

TEST(TrialCampaign, GivesTheSizeOfEachOfTwo) {
  const Rig rig = read_rig(test::null_campaign("rig.toml"));
  const auto draw = [&](const std::vector<std::string>& hidden) {
    std::mt19937_64 random(7);
    return draw_campaign(rig, hidden, 0.03, random);
  };
  const TrialCampaign hum = draw({"mains-hum"}), both = draw({"cubic-stiffness", "mains-hum"}), modes = draw({"higher-mode", "gauge-drift"});
  ASSERT_EQ(hum.sizes.size(), 1u);
  EXPECT_NEAR(hum.sizes[0], hum.size, 1e-9 * hum.size);
  ASSERT_EQ(both.sizes.size(), 2u);
  EXPECT_GT(both.sizes[0], 0);
  EXPECT_GT(both.sizes[1], 0.199) << "signals are drawn from 0.2 to 20 times the noise";
  EXPECT_LT(both.sizes[1], 20.01);
  EXPECT_LT(both.size, both.sizes[0] + both.sizes[1] + 1e-9) << "hum adds to the reading whatever the spring does; two traces add up to no more than both";
  ASSERT_EQ(modes.sizes.size(), 2u);
  EXPECT_GT(modes.sizes[0], 3) << "the modes that this rig has beside the first";
  EXPECT_LT(modes.sizes[1], 20.01);
}

TEST(Trial, NothingHiddenAndAWave) {
  TrialProblem problem;
  problem.rig = read_rig(test::null_campaign("rig.toml"));
  problem.effects = {"tank-wave"};
  problem.trials = 2;
  problem.seed = 1;
  const TrialResult result = run_trials(problem);
  ASSERT_EQ(result.outcomes.size(), 2u);
  for (const TrialOutcome& o : result.outcomes) EXPECT_THAT(o.failure, IsEmpty());
  EXPECT_EQ(result.nulls, 1);
  EXPECT_EQ(result.false_alarms, 0);
  ASSERT_GT(result.outcomes[1].size, 2) << "this seed draws a wave that is far above the noise";
  EXPECT_TRUE(result.outcomes[1].right());
  EXPECT_EQ(result.scores.at("tank-wave").found, 1);
  EXPECT_EQ(result.confusion.at("tank-wave").at("tank-wave"), 1);
  const nlohmann::json json = nlohmann::json::parse(to_json(result));
  EXPECT_EQ(json["trials"][1]["found"][0], "tank-wave");
  EXPECT_THAT(report(result), HasSubstr("0 false alarms in 1 campaigns"));
}

TEST(Trial, WhatIsHiddenOutsideTheCandidatesCannotBeNamed) {
  TrialProblem problem;
  problem.rig = read_rig(test::null_campaign("rig.toml"));
  problem.effects = {"tank-wave", "gauge-drift"};
  problem.trials = 2;
  problem.outside = true;
  const TrialResult result = run_trials(problem);
  ASSERT_EQ(result.outcomes[1].hidden, std::vector<std::string>{"tank-wave"});
  ASSERT_GT(result.outcomes[1].size, 2) << "this seed draws a wave that is far above the noise";
  EXPECT_THAT(result.outcomes[1].found, IsEmpty());
  EXPECT_TRUE(result.outcomes[1].unexplained);
  problem.effects = {"tank-wave"};  // no candidate would be left, and none named means all
  EXPECT_THROW(run_trials(problem), InputError);
}

TEST(Trial, RefusesARigThatCannotBePitched) {
  TrialProblem problem;
  problem.rig.modal = {{2, 3, 0.01, 1000, "N"}};
  EXPECT_THROW(run_trials(problem), InputError);
}

}  // namespace
}  // namespace unrig
