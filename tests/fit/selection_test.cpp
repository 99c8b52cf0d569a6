#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <random>

#include "fit/diagnose/diagnose.h"
#include "fit/diagnose/trial_campaign.h"
#include "tests/support/sample_data.h"

namespace unrig {
namespace {

using testing::UnorderedElementsAre;

/// A drag and a spring of much the same size. A wave with an amplitude for every run comes first, and the spring beside it leaves little; only in the wave's place does the drag come in.
TEST(Selection, TheFirstToBeFoundIsExchangedForWhatItStoodInFor) {
  std::seed_seq sequence{3002, 5};
  std::mt19937_64 random(sequence);
  std::uniform_int_distribution<std::size_t>(1, 14)(random);  // as `unrig trial --pairs --seed 3002` draws the second effect of trial 5
  const TrialCampaign campaign = draw_campaign(read_rig(test::null_campaign("rig.toml")), {"quadratic-drag", "cubic-stiffness"}, draw_runs(0.03, random), random);
  ASSERT_GT(campaign.sizes[0], 30);
  ASSERT_GT(campaign.sizes[1], 30);
  DiagnoseProblem problem;
  problem.rig = campaign.rig;
  problem.runs = campaign.runs;
  problem.verdict_only = true;
  problem.effects = {"tank-wave", "cubic-stiffness", "quadratic-drag"};
  const Diagnosis d = diagnose(problem);
  ASSERT_FALSE(d.ranking.empty());
  bool wave_came_first = false;
  for (const Candidate& c : d.ranking) wave_came_first = wave_came_first || c.effects == std::vector<std::string>{"tank-wave", "cubic-stiffness"};
  EXPECT_TRUE(wave_came_first) << "otherwise this campaign tests nothing of the exchange";
  std::vector<std::string> found;
  for (const MissingEffect& m : d.missing) found.push_back(m.effect);
  EXPECT_THAT(found, UnorderedElementsAre("quadratic-drag", "cubic-stiffness"));
  EXPECT_FALSE(d.unexplained);
}

}  // namespace
}  // namespace unrig
