#include "fit/trial/trial_files.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "core/effects/effect.h"
#include "core/files/error.h"
#include "fit/trial/laboratory.h"
#include "fit/trial/trial_campaign.h"
#include "tests/support/sample_data.h"

namespace unrig {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;

TEST(TrialCampaign, HidesWhatItSaysAndRepeats) {
  const Rig rig = read_rig(test::null_campaign("rig.toml"));
  const auto draw = [&](const std::vector<std::string>& hidden) {
    std::mt19937_64 random(7);
    return draw_campaign(rig, hidden, draw_runs(0.03, random), ideal_laboratory(), random);
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
    return draw_campaign(rig, hidden, draw_runs(0.03, random), ideal_laboratory(), random);
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

/// What a trial hides must be there to be found: `twist-stiffness` and `elastic-coupling` were hidden with a size of 6e-11 and 0, and the sensor that they need was dropped. Traces are r.m.s. over the
/// noise; rounding leaves some 1e-10 of it.
TEST(TrialCampaign, EveryEffectOfTheTableLeavesATrace) {
  Rig rig = read_rig(test::null_campaign("rig.toml"));
  rig.sensors.push_back({"twist", SensorKind::twist, 14, 1, "rad"});
  constexpr double trace = 1e-3;
  for (const Effect& e : effects())
    for (const unsigned seed : {1U, 2U}) {
      std::mt19937_64 random(seed);
      std::vector<PlannedRun> runs = draw_runs(0.03, random);
      runs.erase(runs.begin() + 2, runs.end() - 1);  // both plucks and the step from 25 degrees
      const TrialCampaign campaign = draw_campaign(rig, {e.id}, runs, ideal_laboratory(), random);
      ASSERT_EQ(campaign.sizes.size(), 1u) << e.id;
      EXPECT_GT(campaign.sizes.front(), trace) << e.id;
      EXPECT_EQ(campaign.parameters.size(), e.parameters.size()) << e.id;
      for (const unrig::Run& run : campaign.runs) {
        ASSERT_NE(run.find("twist"), nullptr) << e.id;
        EXPECT_TRUE(run.find("twist")->value.allFinite()) << e.id;
      }
    }
}

TEST(TrialCampaign, RepeatsRecordings) {
  const Rig rig = read_rig(test::null_campaign("rig.toml"));
  std::vector<unrig::Run> recordings;
  for (const char* file : {"dry_pluck.csv", "step_b.csv", "step_c.csv"}) recordings.push_back(read_run(test::null_campaign(file)));
  recordings[1].channels[1].value.segment(700, 3).setConstant(NAN);
  std::mt19937_64 random(3);
  const std::vector<PlannedRun> planned = runs_like(rig, recordings, {}, random);
  const TrialCampaign campaign = draw_campaign(rig, {}, planned, ideal_laboratory(), random);
  ASSERT_EQ(campaign.runs.size(), 3u);
  for (std::size_t r = 0; r < 3; ++r) {
    EXPECT_EQ(campaign.runs[r].samples(), recordings[r].samples());
    EXPECT_EQ(campaign.runs[r].dt, recordings[r].dt);
    EXPECT_EQ(campaign.runs[r].speed, recordings[r].speed);
    EXPECT_EQ(campaign.runs[r].file, recordings[r].file);
    EXPECT_NEAR(planned[r].noise, 0.02724, 0.1 * 0.02724) << "sigma of KEY.json; sixth differences of so many samples scatter by 3 %";
  }
  EXPECT_TRUE(campaign.runs[1].channel(recordings[1].channels[1].name).value.segment(700, 3).array().isNaN().all());
  EXPECT_EQ(campaign.runs[1].channel(recordings[1].channels[1].name).value.array().isNaN().count(), 3);
  const Eigen::VectorXd &angle = campaign.runs[2].channel("alpha").value, &there = recordings[2].channel("alpha").value;
  const double apart = std::sqrt((angle - there).squaredNorm() / static_cast<double>(angle.size()));
  EXPECT_NEAR(apart, std::sqrt(2.0) * planned[2].angle_noise, 0.1 * planned[2].angle_noise) << "the same motion, spikes included; two draws of the noise";
  EXPECT_GT(planned[2].slope, 2.5);
  EXPECT_LT(planned[2].slope, 0.7 * 2 * 3.1416) << "stalled at 25 degrees";
  const unrig::Run wet = read_run(test::null_campaign("wet_pluck.csv"));
  EXPECT_NEAR(runs_like(rig, {wet}, {}, random).front().release, wet.channel("gauge").value[0], 0.03 * wet.channel("gauge").value[0]) << "swings about nought: the mean of some periods is left, and the noise";
  const auto swing = [](const Eigen::VectorXd& gauge) { return gauge.head(200).maxCoeff() - gauge.head(200).minCoeff(); };
  EXPECT_NEAR(swing(campaign.runs[0].channel("gauge").value) / swing(recordings[0].channel("gauge").value), 1, 0.1) << "released from the same load; frequencies and damping differ";
}

TEST(TrialCampaign, RefusesRecordingsThatItCannotRepeat) {
  const Rig rig = read_rig(test::null_campaign("rig.toml"));
  unrig::Run run = read_run(test::null_campaign("step_b.csv"));
  std::mt19937_64 random(3);
  Eigen::VectorXd& alpha = run.channels[static_cast<std::size_t>(run.find("alpha") - run.channels.data())].value;
  for (Eigen::Index k = 0; k < alpha.size(); ++k) alpha[k] = 0.05 * std::sin(0.01 * static_cast<double>(k)) + 1e-4 * std::sin(1.7 * static_cast<double>(k) * static_cast<double>(k));
  EXPECT_THROW(runs_like(rig, {run}, {}, random), InputError) << "never at rest";
  run.kind = RunKind::forced;
  EXPECT_THROW(runs_like(rig, {run}, {}, random), InputError);
}

TEST(Trial, NothingHiddenAndAWave) {
  TrialProblem problem;
  problem.rig = read_rig(test::null_campaign("rig.toml"));
  problem.ideal = true;
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
  EXPECT_THAT(result.outcomes[0].named, IsEmpty());
  ASSERT_EQ(result.outcomes[1].named.size(), 2u) << "frequency and decay time";
  for (std::size_t k = 0; k < 2; ++k) {
    const NamedParameter& p = result.outcomes[1].named[k];
    EXPECT_EQ(p.truth, result.outcomes[1].parameters[k]) << p.name;
    EXPECT_LT(p.deviation(), 4) << p.name;
    EXPECT_EQ(json["trials"][1]["named"][k]["name"], p.name);
  }
  EXPECT_EQ(json["reliability"]["intervals"]["parameters"], 2);
  EXPECT_THAT(report(result), HasSubstr("0 false alarms in 1 campaigns"));
}

TEST(Trial, WhatIsHiddenOutsideTheCandidatesCannotBeNamed) {
  TrialProblem problem;
  problem.rig = read_rig(test::null_campaign("rig.toml"));
  problem.ideal = true;
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

TEST(Trial, OfFilesThatAreOffTheRigsDescriptionIsNoFalseName) {
  TrialOutcome o;
  o.found = {"rig-description"};
  EXPECT_FALSE(o.right());
  EXPECT_TRUE(o.false_name());
  o.misread = "normal.mass";
  EXPECT_TRUE(o.right());
  EXPECT_FALSE(o.false_name());
  o.hidden = {"tank-wave"};
  EXPECT_FALSE(o.right());
  o.found = {"rig-description", "tank-wave"};
  EXPECT_TRUE(o.right());
  o.found = {"gauge-drift"};
  EXPECT_TRUE(o.false_name());
  o.misread = as_stated;
  o.found = {"rig-description", "tank-wave"};
  EXPECT_FALSE(o.right()) << "what the files state is nothing missing";
  EXPECT_TRUE(o.false_name());
}

/// Ten names stated with 0.9, of which six are right, and ten with 0.6, of which six are: off by 0.3 and 0, by 0.15 in the mean.
TEST(Trial, CountsWhetherStatedProbabilitiesHold) {
  TrialResult result;
  for (const double stated : {0.9, 0.6})
    for (int i = 0; i < 10; ++i) {
      TrialOutcome o;
      o.hidden = {"tank-wave"};
      o.found = {i < 6 ? "tank-wave" : "gauge-drift"};
      o.probability = stated;
      result.outcomes.push_back(o);
    }
  result.outcomes.emplace_back().unexplained = true;  // names nothing, states nothing
  tally(result);
  EXPECT_EQ(result.reliability.campaigns, 20);
  ASSERT_EQ(result.reliability.bins.size(), 2u);
  EXPECT_NEAR(result.reliability.bins[0].stated, 0.6, 1e-12);
  EXPECT_EQ(result.reliability.bins[0].right, 6);
  EXPECT_NEAR(result.reliability.calibration_error, 0.15, 1e-12);
  EXPECT_NEAR(result.reliability.brier, (0.6 * 0.01 + 0.4 * 0.81 + 0.6 * 0.16 + 0.4 * 0.36) / 2, 1e-12);
  EXPECT_EQ(result.wrong_names, 8);
}

/// Four campaigns: the right set alone, the right one among two, neither of two, and whatever else.
TEST(Trial, CountsWhetherExplanationsHoldTheTruth) {
  TrialResult result;
  const std::vector<std::vector<std::vector<std::string>>> given{{{"tank-wave"}}, {{"gauge-drift"}, {"rig-description", "tank-wave"}}, {{"gauge-drift"}, {"tank-wave", "mains-hum"}}, {{"gauge-drift"}, {"something-else"}}};
  for (const auto& explanations : given) {
    TrialOutcome o;
    o.hidden = {"tank-wave"};
    o.misread = "speed";
    o.explanations = explanations;
    result.outcomes.push_back(o);
  }
  tally(result);
  EXPECT_EQ(result.reliability.explained, 4);
  EXPECT_EQ(result.reliability.held, 3);
  EXPECT_NEAR(result.reliability.members, 7 / 4.0, 1e-12);
}

/// Deviations of 0.5, 1.5 and 2.5 standard errors.
TEST(Trial, CountsWhetherIntervalsHoldTheTruth) {
  TrialResult result;
  result.outcomes.resize(2);
  result.outcomes[0].named = {{"a", 3, 3.5, 1}, {"b", 3, 0, 2}};
  result.outcomes[1].named = {{"a", -1, -1.25, 0.1}};
  tally(result);
  EXPECT_EQ(result.reliability.parameters, 3);
  EXPECT_EQ(result.reliability.within_68, 1);
  EXPECT_EQ(result.reliability.within_95, 2);
}

TEST(Trial, RefusesARigThatCannotBePitched) {
  TrialProblem problem;
  problem.rig.modal = {{2, 3, 0.01, 1000, "N"}};
  EXPECT_THROW(run_trials(problem), InputError);
}

}  // namespace
}  // namespace unrig
