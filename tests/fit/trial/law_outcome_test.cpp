#include "fit/trial/law_outcome.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <string>

#include "fit/trial/law_files.h"

namespace unrig {
namespace {

Law spring(double power, const std::string& name = "spring with a power") {
  return parse_law("unrig_law = 1\nname = \"" + name + "\"\nacts_on = \"normal\"\nforce = \"-c * abs(x)^p * sign(x)\"\n[parameters]\nc = { start = \"1 N\" }\np = { start = " + std::to_string(power) + ", lower = 0.1 }\n[scales]\nx = \"2 mm\"\n", "spring");
}

MissingEffect missing(const std::string& effect, const std::string& kind) {
  MissingEffect m;
  m.effect = effect;
  m.kind = kind;
  return m;
}

MissingEffect missing(const Law& law) {
  MissingEffect m = missing(law.id(), law.kind());
  m.law = FoundLaw{law, {}};
  return m;
}

Rival rival(const Law& law) { return {{law.id()}, law.force_text, "", law_text(law), 1, 1}; }

TEST(LawOutcome, TheSameFormIsRight) {
  Diagnosis d;
  d.missing = {missing(spring(2.6))};
  const LawOutcome o = judged(spring(2.5), false, 0.1, false, d);
  EXPECT_TRUE(o.equation_right);
  EXPECT_TRUE(o.class_right);
  EXPECT_FALSE(o.among_rivals);
  EXPECT_FALSE(o.wrong_alone());
  EXPECT_EQ(o.hidden.parameters[1].value, 2.5);
  EXPECT_EQ(o.hidden.scales, (std::map<std::string, double>{{"x", 0.002}}));
  EXPECT_EQ(o.named.front().parameters[1].value, 2.6);
}

TEST(LawOutcome, AnEffectOfTheListIsRightWhereItSaysTheSame) {
  Diagnosis d;
  d.missing = {missing("cubic-stiffness", "stiffness")};
  EXPECT_TRUE(judged(spring(2.8), false, 0.1, false, d).equation_right);
  EXPECT_TRUE(judged(spring(3.25), false, 0.1, false, d).equation_right);
  const LawOutcome other = judged(spring(2.5), false, 0.1, false, d);
  EXPECT_FALSE(other.equation_right);
  EXPECT_TRUE(other.class_right);
  EXPECT_TRUE(other.wrong_alone());
}

TEST(LawOutcome, ARivalIsNoWrongNameAloneAndCompanyIsNotRight) {
  Diagnosis d;
  d.missing = {missing(spring(2, "curve of the displacement"))};
  d.missing.front().law->rivals = {rival(spring(2.5)), rival(spring(3, "another"))};
  d.equivalent = {{"tank-wave"}};
  const LawOutcome o = judged(spring(2.5), false, 0.1, false, d);
  EXPECT_TRUE(o.among_rivals);
  EXPECT_FALSE(o.wrong_alone());
  EXPECT_TRUE(o.curve());
  EXPECT_FALSE(o.class_right) << "a curve has no class";
  EXPECT_EQ(o.rivals, 3);
  d.missing = {missing(spring(2.5)), missing("tank-wave", "signal")};
  const LawOutcome company = judged(spring(2.5), false, 0.1, false, d);
  EXPECT_TRUE(company.wrong_alone());
  EXPECT_TRUE(company.in_company);
  d.missing.front() = missing(spring(2, "curve of the displacement"));
  EXPECT_FALSE(judged(spring(2.5), false, 0.1, false, d).curve()) << "and a wave";
  d.missing = {missing(spring(2.5)), missing(rig_description_id, "")};
  EXPECT_FALSE(judged(spring(2.5), false, 0.1, false, d).equation_right);
  EXPECT_TRUE(judged(spring(2.5), false, 0.1, true, d).equation_right) << "files are off";
}

TEST(LawOutcome, HoldsSetsAndHeldOutRunsAgainstTheExactModel) {
  Diagnosis d;
  d.missing = {missing(spring(2.5))};
  d.truth = AgainstTruth{1.01, {0.1, 0.2}, {{{}, 900.0}, {{"law:spring with a power"}, 0.5}, {{"law:another"}, 25.0}, {{"cubic-stiffness"}, 14.0}, {{"tank-wave", "law:spring with a power"}, -3.0}, {{"bouc-wen"}, NAN}}};
  d.runs = {{"a.csv", "gauge", "N", false, false, 3, 0.1, 0.1}, {"h.csv", "gauge", "N", true, false, 3, 0.11, 0.1}, {"i.csv", "gauge", "N", true, false, 3, 0.26, 0.2}};
  const LawOutcome o = judged(spring(2.5), false, 0.1, false, d);
  EXPECT_EQ(o.exact_left, 1.01);
  EXPECT_EQ(o.ahead, 14) << "what holds the true law beside something else can only be ahead";
  EXPECT_EQ(o.behind, 0.5);
  EXPECT_NEAR(*o.heldout, 1.3, 1e-12) << "the worse of the two";
  EXPECT_EQ(judged(spring(2.95), false, 0.1, false, d).ahead, 25) << "a cubic spring is the truth";
}

LawOutcome made_up(bool named, bool right, bool rival, std::size_t rivals, double ahead, double heldout) {
  LawOutcome o;
  if (named) o.named = {{"law:x", "stiffness", "", ""}};
  o.equation_right = right;
  o.among_rivals = rival;
  o.rivals = rivals;
  o.unexplained = !named;
  o.ahead = ahead;
  o.heldout = heldout;
  return o;
}

TEST(LawOutcome, Counts) {
  std::vector<LawOutcome> all{made_up(true, true, false, 0, 30, 1), made_up(true, false, true, 4, 12, 1.1), made_up(true, false, false, 1, 9, 1.3), made_up(false, false, false, 0, 11, 1.2), made_up(true, true, false, 2, 3, 1.19)};
  all[3].outside = true;
  all[2].outside = true;
  all[2].named.front().kind = "curve";
  std::vector<const LawOutcome*> outcomes;
  for (const LawOutcome& o : all) outcomes.push_back(&o);
  const LawCounts n = count_laws(outcomes);
  EXPECT_EQ(n.campaigns, 5);
  EXPECT_EQ(n.right, 2);
  EXPECT_EQ(n.among_rivals, 1);
  EXPECT_EQ(n.wrong_alone, 1);
  EXPECT_EQ(n.unexplained, 1);
  EXPECT_EQ(n.nothing, 0);
  EXPECT_EQ(n.decided, 3);
  EXPECT_EQ(n.decided_right, 2);
  EXPECT_EQ(n.median_rivals, 1.5) << "of 0, 1, 2, 4";
  EXPECT_EQ(n.most_rivals, 4);
  EXPECT_EQ(n.heldout_within, 4);
  EXPECT_EQ(n.outside, 2);
  EXPECT_EQ(n.outside_right, 1) << "a curve, but 1.3 times on the run held out";
  EXPECT_EQ(n.curve, 1);
}

TEST(LawOutcome, ReadsBackAsItIsWritten) {
  Diagnosis d;
  d.missing = {missing(spring(2.6)), missing("tank-wave", "signal")};
  d.equivalent = {{"gauge-drift"}};
  d.truth = AgainstTruth{1.01, {}, {{{}, 900.0}}};
  for (const LawOutcome& o : {judged(spring(2.5), true, 0.1, false, d), judged(spring(2.5), false, 0.1, false, Diagnosis{})}) {
    const nlohmann::ordered_json json = json_of(o);
    EXPECT_EQ(json_of(law_outcome_of(nlohmann::ordered_json::parse(json.dump()))), json);
  }
}

}  // namespace
}  // namespace unrig
