#include "fit/diagnose/reliability.h"

#include <gtest/gtest.h>

#include <numeric>
#include <string>
#include <vector>

namespace unrig {
namespace {

using Strings = std::vector<std::string>;

/// A verdict with these effects named, and sets that were tried with these probabilities among them, the first is that of the named ones.
Diagnosis verdict_of(const Strings& named, const std::vector<double>& probabilities) {
  Diagnosis d;
  d.mismatch.found = true;
  for (const std::string& id : named) d.missing.emplace_back().effect = id;
  for (std::size_t i = 0; i < probabilities.size(); ++i) {
    d.ranking.emplace_back().effects = i == 0 ? named : Strings{"other " + std::to_string(i)};
    d.ranking.back().probability = probabilities[i];
  }
  return d;
}

double sum_of(const std::vector<StatedExplanation>& some) {
  return std::accumulate(some.begin(), some.end(), 0.0, [](double sum, const StatedExplanation& e) { return sum + e.probability; });
}

TEST(Explanations, AreTheFewestThatHoldTheTruth) {
  for (const std::vector<double>& tried : {std::vector<double>{1}, {0.6, 0.3, 0.1}, {0.9, 0.05, 0.03, 0.02}, {0.2, 0.2, 0.2, 0.2, 0.2}}) {
    const Diagnosis d = verdict_of({"tank-wave"}, tried);
    std::vector<StatedExplanation> held = explanations_of(d);
    EXPECT_GE(sum_of(held), explanations_hold);
    EXPECT_LE(sum_of(held), 1 + 1e-12);
    EXPECT_EQ(held.front().effects, Strings{"tank-wave"});
    EXPECT_NEAR(held.front().probability, tried.front() * share_of_right(d), 1e-12);
    for (std::size_t i = 1; i < held.size(); ++i) EXPECT_LE(held[i].probability, held[i - 1].probability);
    held.pop_back();
    EXPECT_LT(sum_of(held), explanations_hold) << "one more than it takes";
  }
}

/// What is left of 1 belongs to what was not tried.
TEST(Explanations, LeaveToSomethingElseWhatVerdictsLikeThisWereWrongIn) {
  for (const Strings& named : {Strings{"mains-hum"}, {"mains-hum", "tank-wave"}, {"rig-description"}, {"law:spring with a sine"}}) {
    const Diagnosis d = verdict_of(named, {1});
    double other = 0, all = 0;
    for (const StatedExplanation& e : explanations_of(d)) {
      all += e.probability;
      if (e.effects == Strings{something_else}) other = e.probability;
    }
    const double right = share_of_right(d);
    EXPECT_GT(right, 0);
    EXPECT_LT(right, 1) << "no count is so long that none is ever wrong";
    if (right < explanations_hold) {
      EXPECT_NEAR(other, 1 - right, 1e-12);
      EXPECT_NEAR(all, 1, 1e-12);
    } else {
      EXPECT_EQ(other, 0);
    }
  }
}

/// A formula, or a rig file that is off, may stand in for an effect.
TEST(Explanations, TrustAnEffectOfTheListMoreThanWhatMayStandInForIt) {
  const double listed = share_of_right(verdict_of({"mains-hum"}, {1}));
  EXPECT_LT(share_of_right(verdict_of({"law:spring with a sine"}, {1})), listed);
  EXPECT_LT(share_of_right(verdict_of({"rig-description"}, {1})), listed);
}

TEST(Explanations, OfAMismatchThatNothingExplainsAreSomethingElse) {
  Diagnosis d = verdict_of({}, {1});
  d.unexplained = true;
  const std::vector<StatedExplanation> held = explanations_of(d);
  ASSERT_EQ(held.size(), 1u);
  EXPECT_EQ(held.front().effects, Strings{something_else});
}

TEST(Explanations, OfRunsThatAreExplainedBeginWithNothing) {
  const Diagnosis d;
  EXPECT_TRUE(explanations_of(d).front().effects.empty());
  EXPECT_GE(sum_of(explanations_of(d)), explanations_hold);
}

}  // namespace
}  // namespace unrig
