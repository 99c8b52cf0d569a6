// The gate: data that are right pass in silence, alone and together; what slips do to a single estimate.

#include "core/check/gate.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <string>
#include <tuple>
#include <vector>

#include "core/check/run_estimate.h"
#include "tests/support/sample_data.h"
#include "tests/support/shared_data.h"

namespace unrig {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;

const std::vector<std::string> names{"dry_pluck", "heldout", "step_a", "step_b", "step_c", "wet_pluck"};

std::string text_of(const std::vector<Suspicion>& suspicions) {
  std::string text;
  for (const Suspicion& s : suspicions) text += s.text + "\n";
  return text;
}

std::vector<std::string> folders_with_a_rig(const std::string& root) {
  std::vector<std::string> folders;
  for (const auto& entry : std::filesystem::directory_iterator(root))
    if (std::filesystem::exists(entry.path() / "rig.toml")) folders.push_back(entry.path().string());
  std::sort(folders.begin(), folders.end());
  EXPECT_FALSE(folders.empty()) << root << ": nothing was looked at";
  return folders;
}

/// All runs of a campaign together, each alone, and the steps without the decays.
void expect_silence(const std::string& folder) {
  const Rig rig = read_rig(folder + "/rig.toml");
  std::vector<Run> runs, steps;
  for (const std::string& name : names) runs.push_back(read_run(folder + "/" + name + ".csv"));
  for (const Run& run : runs) {
    EXPECT_THAT(suspicions(rig, {run}), IsEmpty()) << run.file << "\n" << text_of(suspicions(rig, {run}));
    if (run.kind == RunKind::step) steps.push_back(run);
  }
  EXPECT_THAT(suspicions(rig, runs), IsEmpty()) << folder << "\n" << text_of(suspicions(rig, runs));
  EXPECT_THAT(suspicions(rig, steps), IsEmpty()) << folder << "\n" << text_of(suspicions(rig, steps));
}

std::vector<unrig::Run> null_runs() {
  std::vector<unrig::Run> runs;
  for (const char* name : {"dry_pluck.csv", "wet_pluck.csv", "step_a.csv", "step_b.csv", "step_c.csv"}) runs.push_back(read_run(test::null_campaign(name)));
  return runs;
}

TEST(Gate, IsSilentOverAllSampleCampaigns) {
  for (const char* set : {"campaigns", "concealed"})
    for (const std::string& folder : folders_with_a_rig(test::source_path(std::string("sample_data/") + set))) expect_silence(folder);
}

TEST(Gate, IsSilentOverCampaignsNearerToALaboratory) {
  UNRIG_NEEDS_SHARED("campaigns/open2");
  for (const std::string& folder : folders_with_a_rig(test::shared_path("campaigns/open2"))) expect_silence(folder);
}

TEST(Gate, IsSilentOverMeasuredRecordings) {
  UNRIG_NEEDS_SHARED("real");
  for (const std::string& folder : folders_with_a_rig(test::shared_path("real"))) {
    const Rig rig = read_rig(folder + "/rig.toml");
    for (const auto& entry : std::filesystem::directory_iterator(folder))
      if (entry.path().extension() == ".csv") {
        EXPECT_THAT(suspicions(rig, {read_run(entry.path().string())}), IsEmpty()) << entry.path();
      }
  }
}

TEST(Gate, FindsTheRunAndTheFactorOfEverySlipInTheGauge) {
  const Rig rig = read_rig(test::null_campaign("rig.toml"));
  for (const double factor : {-1.0, 4.4482216152605, 1 / 4.4482216152605, 1000.0, 1e-3}) {
    std::vector<unrig::Run> runs = null_runs();
    for (Channel& channel : runs[3].channels)
      if (channel.name == "gauge") channel.value *= factor;
    const std::vector<Suspicion> found = suspicions(rig, runs);
    ASSERT_EQ(found.size(), 1u) << factor << "\n" << text_of(found);
    EXPECT_EQ(found.front().where, "step_b.csv");
    EXPECT_NEAR(found.front().factor, factor, 1e-6 * std::abs(factor));
    EXPECT_LE(found.front().causes.size(), 2u);
    EXPECT_TRUE(found.front().grave);
    EXPECT_THAT(found.front().text, HasSubstr("Without step_b.csv the other runs agree."));
  }
}

TEST(Gate, FindsAnotherGaugeOrCalibrationElement) {
  const Rig rig = read_rig(test::null_campaign("rig.toml"));  // 7 and 16
  for (const auto& [gauge, calibration, words] : {std::tuple{12, 16, "gauge element 12 written for 7"}, std::tuple{7, 15, "calibration element 15 written for 16"}}) {
    Rig other = rig;
    other.gauge_element = gauge;
    other.calibration_element = calibration;
    const std::vector<Suspicion> found = suspicions(other, null_runs());
    ASSERT_EQ(found.size(), 1u) << words << "\n" << text_of(found);
    EXPECT_EQ(found.front().where, "rig.toml");
    EXPECT_THAT(found.front().text, HasSubstr(words));
    EXPECT_TRUE(found.front().grave);
  }
}

TEST(Gate, FindsAGaugeThatIsLateWithoutStoppingForIt) {
  constexpr Eigen::Index late = 10;  // 20 ms
  for (const std::string step : {"step_a.csv", "step_b.csv", "step_c.csv"}) {  // the last one is stalled
    std::vector<unrig::Run> runs = null_runs();
    for (unrig::Run& run : runs)
      for (Channel& channel : run.channels)
        if (run.file.ends_with(step) && channel.name == "gauge") {
          const Eigen::VectorXd was = channel.value;
          for (Eigen::Index k = 0; k < was.size(); ++k) channel.value[k] = was[std::max<Eigen::Index>(0, k - late)];
        }
    const std::vector<Suspicion> found = suspicions(read_rig(test::null_campaign("rig.toml")), runs);
    ASSERT_EQ(found.size(), 1u) << step << text_of(found);
    EXPECT_EQ(found.front().where, step);
    EXPECT_NEAR(found.front().factor, 0.020, 0.0021) << "a sample is 2 ms";
    EXPECT_FALSE(found.front().grave) << "an effect follows it";
  }
}

TEST(Gate, ARunOfThreeSamplesIsNamedAndDoesNoHarm) {
  const Rig rig = read_rig(test::null_campaign("rig.toml"));
  unrig::Run run = read_run(test::null_campaign("step_a.csv"));
  for (Channel& channel : run.channels) channel.value.conservativeResize(3);
  const std::vector<Suspicion> found = suspicions(rig, {run});
  ASSERT_EQ(found.size(), 1u);
  EXPECT_FALSE(found.front().grave);
  EXPECT_THAT(found.front().text, ::testing::HasSubstr("3 samples, 0.006 s"));
}

TEST(RunEstimate, OfTheSampleWithoutEffectsIsWhatWasPutIn) {
  // sample_data/campaigns/KEY.json: stiffness scale 0.7887, apparent mass 1.1219, slope 5.8636.
  const CheckModel model(read_rig(test::null_campaign("rig.toml")));
  const RunEstimate dry = estimate(model, read_run(test::null_campaign("dry_pluck.csv")));
  EXPECT_NEAR(std::exp(dry.stiffness), 0.7887, 0.005) << "the line of five seconds is good to 0.2 %";
  const RunEstimate wet = estimate(model, read_run(test::null_campaign("wet_pluck.csv")));
  EXPECT_NEAR(std::exp((dry.stiffness - wet.stiffness) / wet.fluid_share), 1.1219, 0.02);
  const RunEstimate step = estimate(model, read_run(test::null_campaign("step_a.csv")), dry.stiffness);
  EXPECT_NEAR(std::exp(step.steady) * 2 * M_PI, 5.8636, 0.05);
  EXPECT_FALSE(step.reversed);
  EXPECT_FALSE(step.stalled);
}

TEST(RunEstimate, PassesOverAMotionWithoutRests) {
  unrig::Run run = read_run(test::null_campaign("step_a.csv"));
  for (Channel& channel : run.channels)
    if (channel.name == "alpha")
      for (Eigen::Index k = 0; k < channel.value.size(); ++k) channel.value[k] = 0.03 * std::sin(0.02 * static_cast<double>(k));
  const RunEstimate found = estimate(CheckModel(read_rig(test::null_campaign("rig.toml"))), run);
  EXPECT_FALSE(found.moves);
  EXPECT_TRUE(found.turns);
  EXPECT_TRUE(std::isnan(found.steady));
}

}  // namespace
}  // namespace unrig
