#include "fit/trial/hidden_law.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <set>
#include <string>
#include <vector>

#include "core/law/law_effect.h"
#include "core/model/simulate.h"
#include "fit/trial/trial_campaign.h"
#include "tests/support/sample_data.h"

namespace unrig {
namespace {

/// A pluck in water, which reaches farthest, and the steps.
std::vector<PlannedRun> some_runs() {
  std::mt19937_64 random(5);
  std::vector<PlannedRun> runs = draw_runs(0.03, random);
  runs.erase(runs.begin());
  return runs;
}

/// Of a pluck alone: its first swings reach farthest.
Reached first_swings(const Rig& rig) {
  Reached reached = reached_by(rig, {some_runs().front()});
  reached.symbols.front().conservativeResize(400, Eigen::NoChange);
  return reached;
}

/// Largest slope of the force in the displacement on a grid of the reach, all else at rest: a positive one takes from the stiffness.
double pushes(const Law& law, double reach) {
  std::array<double, symbol_count> symbols{}, slope{};
  std::vector<double> values, partial(law.parameters.size());
  for (const Parameter& p : law.parameters) values.push_back(p.start);
  double most = 0;
  for (int i = -50; i <= 50; ++i) {
    symbols[0] = reach * i / 50;
    law.force(symbols.data(), values.data(), slope.data(), partial.data());
    most = std::max(most, slope[0]);
  }
  return most;
}

class HiddenLaws : public testing::TestWithParam<bool> {
 protected:
  const Rig rig_ = read_rig(test::null_campaign("rig.toml"));
  const std::vector<PlannedRun> runs_ = some_runs();
  const Reached reached_ = reached_by(rig_, runs_);
  const std::vector<Law> laws_ = laws_to_hide(rig_, reached_, GetParam());
};

TEST_P(HiddenLaws, AreDrawnInRange) {
  for (const Law& form : laws_)
    for (const unsigned seed : {1U, 2U, 3U}) {
      std::mt19937_64 random(seed);
      const Law law = draw_law(form, reached_, random);
      EXPECT_TRUE(law.says_the_same_as(form)) << form.name;
      const double of = largest_force(law, reached_) / (law.acts_on == ActsOn::torsion ? reached_.reach.moment : reached_.reach.force);
      EXPECT_GT(of, 0.02 * (1 - 1e-9)) << form.name;
      EXPECT_LT(of, 0.3 * (1 + 1e-9)) << form.name;
      for (std::size_t k = 0; k < law.parameters.size(); ++k) {
        const Parameter& p = law.parameters[k];
        EXPECT_TRUE(p.start >= p.lower && p.start <= p.upper) << form.name << " " << p.name;
        if (p.name == "p" || p.name == "n") {
          EXPECT_TRUE(p.start >= 0.5 && p.start <= 4) << form.name << " " << p.start;
        }
        if (p.unit == "m") {
          EXPECT_TRUE(p.start >= 0.099 * reached_.reach.x && p.start <= 4 * reached_.reach.x) << form.name << " " << p.name;
        }
      }
    }
}

/// A law that runs away, or that pushes the rig farther than it would have gone, is no law to look for.
TEST_P(HiddenLaws, SimulateFiniteRuns) {
  const std::vector<PlannedRun> runs{runs_[0], runs_[3]};
  const AeroelasticModel bare = whole_model(rig_, runs);
  for (const Law& form : laws_)
    for (const unsigned seed : {11U, 12U}) {
      std::mt19937_64 random(seed);
      Rig with = rig_;
      add_law(with, draw_law(form, reached_, random));
      const AeroelasticModel model = whole_model(with, runs).with_effects({with.laws.back()->id});
      for (const PlannedRun& planned : runs) {
        const Eigen::VectorXd gauge = simulate(problem_of(model, model.start_values(), planned)).run.channel("gauge").value;
        const Eigen::VectorXd without = simulate(problem_of(bare, bare.start_values(), planned)).run.channel("gauge").value;
        ASSERT_TRUE(gauge.allFinite()) << form.name;
        EXPECT_LT(gauge.cwiseAbs().maxCoeff(), 1.5 * without.cwiseAbs().maxCoeff()) << form.name;
      }
    }
}

TEST_P(HiddenLaws, AreEachHiddenOnceInTurn) {
  std::set<std::string> ids;
  for (const Law& law : laws_) EXPECT_TRUE(ids.insert(law.id()).second) << law.name;
  EXPECT_GE(ids.size(), GetParam() ? 6 : 25);
}

TEST_P(HiddenLaws, LeaveTheRigItsStiffness) {
  const Reached reached = first_swings(rig_);
  for (const Law& form : laws_to_hide(rig_, reached, GetParam())) {
    std::mt19937_64 random(1);
    for (int draw = 0; draw < 60 && form.uses(Symbol::x) && form.acts_on == ActsOn::normal; ++draw)
      ASSERT_LT(pushes(draw_law(form, reached, random), reached.reach.x), 0.8 * reached.reach.force / reached.reach.x) << form.name;
  }
}

INSTANTIATE_TEST_SUITE_P(Of, HiddenLaws, testing::Bool(), [](const auto& which) { return std::string(which.param ? "outside" : "the_dictionary"); });

TEST(HiddenLaw, IsOneThatTheRunsMove) {
  const Rig rig = read_rig(test::null_campaign("rig.toml"));
  const auto symbols = [&](const std::vector<PlannedRun>& runs) {
    std::set<Symbol> used;
    for (const Law& law : laws_to_hide(rig, reached_by(rig, runs), false))
      for (const Symbol s : {Symbol::U, Symbol::theta, Symbol::alpha})
        if (law.uses(s)) used.insert(s);
    return used;
  };
  EXPECT_EQ(symbols(some_runs()).size(), 3u);
  EXPECT_TRUE(symbols({some_runs().front()}).empty()) << "a pluck at rest, in still water";
}

/// A load that releases a softer rig takes it farther: by so much more the gap of a law that closes must be.
TEST(HiddenLaw, IsPutToTheRigAsItIs) {
  const Rig rig = read_rig(test::null_campaign("rig.toml"));
  const std::vector<PlannedRun> runs{some_runs().front()};
  const AeroelasticModel model = whole_model(rig, runs);
  Eigen::VectorXd soft = model.start_values();
  soft[model.index("normal.stiffness_scale")] = 0.7;
  EXPECT_NEAR(reached_by(rig, runs, soft).reach.x / reached_by(rig, runs).reach.x, 1 / 0.7, 0.02) << "modes are those of the rig file";
}

TEST(HiddenLaw, OutsideTheDictionaryNoLineHasItsName) {
  const Rig rig = read_rig(test::null_campaign("rig.toml"));
  const Reached reached = reached_by(rig, some_runs());
  for (const Law& outside : laws_to_hide(rig, reached, true))
    for (const Law& inside : laws_to_hide(rig, reached, false)) EXPECT_TRUE(outside.id() != inside.id() && outside.force_text != inside.force_text) << outside.name;
}

/// Evenly in the logarithm: in 400 draws each half holds 200, give or take 10; both signs where both may be.
TEST(HiddenLaw, IsDrawnEvenlyInTheLogarithm) {
  const Rig rig = read_rig(test::null_campaign("rig.toml"));
  const Reached reached = first_swings(rig);
  const std::vector<Law> laws = laws_to_hide(rig, reached, false);
  const auto damping = std::find_if(laws.begin(), laws.end(), [](const Law& l) { return l.name == "damping with a power"; });
  const auto mass = std::find_if(laws.begin(), laws.end(), [](const Law& l) { return l.name == "mass with a power of the amplitude"; });
  ASSERT_TRUE(damping != laws.end() && mass != laws.end());
  std::mt19937_64 random(1);
  int steep = 0, large = 0, positive = 0;
  for (int i = 0; i < 400; ++i) {
    const Law law = draw_law(*damping, reached, random);
    for (const Parameter& p : law.parameters)
      if (p.name == "p") steep += p.start > std::sqrt(0.5 * 4) ? 1 : 0;
    large += largest_force(law, reached) > std::sqrt(0.02 * 0.3) * reached.reach.force ? 1 : 0;
    positive += draw_law(*mass, reached, random).parameters.front().start > 0 ? 1 : 0;
  }
  for (const int half : {steep, large, positive}) EXPECT_NEAR(half, 200, 50) << "five standard deviations";
}

/// -c x of the first mode: the largest force is c times the reach. A memory z' = v - z / tau with a long tau follows x.
TEST(HiddenLaw, SizeIsTheLargestForce) {
  const Rig rig = read_rig(test::null_campaign("rig.toml"));
  const Reached reached = reached_by(rig, {some_runs().front()});
  const Law spring = parse_law("unrig_law = 1\nname = \"s\"\nacts_on = \"normal\"\nforce = \"-c * x\"\n[parameters]\nc = { start = \"100 N/m\" }\n", "s");
  EXPECT_NEAR(largest_force(spring, reached), 100 * reached.reach.x, 1e-9 * reached.reach.x);
  const Law memory = parse_law("unrig_law = 1\nname = \"m\"\nacts_on = \"normal\"\nforce = \"-f * z\"\nmemory = \"v / g - z / tau\"\n[parameters]\nf = { start = \"1 N\" }\ng = { start = \"1 m\" }\ntau = { start = \"1000 s\" }\n", "m");
  const double swing = reached.symbols.front().col(0).maxCoeff() - reached.symbols.front().col(0).minCoeff();
  EXPECT_NEAR(largest_force(memory, reached), swing, 0.02 * swing) << "from the release to the other side; Euler's method in steps of 0.02 rad";
  std::mt19937_64 random(1);
  const Law lift = parse_law("unrig_law = 1\nname = \"l\"\nacts_on = \"lift\"\nforce = \"-c * alpha\"\n[parameters]\nc = { start = \"1 N\" }\n", "l");
  EXPECT_THROW(draw_law(lift, reached, random), std::runtime_error) << "no stream";
}

}  // namespace
}  // namespace unrig
