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

/// What is left of 1 belongs to what was not tried; of two names more is left than of one, of three more than of two.
TEST(Explanations, LeaveMoreToSomethingElseTheMoreIsNamed) {
  const auto other = [](const Strings& named) {
    for (const StatedExplanation& e : explanations_of(verdict_of(named, {1})))
      if (e.effects == Strings{something_else}) return e.probability;
    return 0.0;
  };
  const double one = 1 - share_of_right(verdict_of({"mains-hum"}, {1})), two = other({"mains-hum", "tank-wave"}), three = other({"mains-hum", "tank-wave", "freeplay"});
  EXPECT_GT(two, one);
  EXPECT_GT(three, two);
  EXPECT_LT(three, 1);
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
