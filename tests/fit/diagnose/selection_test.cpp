#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <string>
#include <vector>

#include "core/model/simulate.h"
#include "fit/diagnose/diagnose.h"
#include "fit/diagnose/law_answer.h"
#include "fit/diagnose/selection.h"
#include "fit/trial/trial_campaign.h"
#include "tests/fit/laws/two_decays.h"
#include "tests/support/long_tests.h"
#include "tests/support/sample_data.h"
#include "tests/support/shared_data.h"

namespace unrig {
namespace {

using testing::UnorderedElementsAre;

using Strings = std::vector<std::string>;

/// As `unrig trial --pairs` draws it, with its own runs or with runs like those of sample_data/campaigns/null.
TrialCampaign pair(unsigned seed, unsigned trial, const Strings& hidden, bool like_recordings) {
  std::seed_seq sequence{seed, trial};
  std::mt19937_64 random(sequence);
  std::uniform_int_distribution<std::size_t>(1, 14)(random);  // which the second effect is
  const Rig rig = read_rig(test::null_campaign("rig.toml"));
  std::vector<unrig::Run> recordings;
  for (const char* run : {"dry_pluck", "wet_pluck", "step_a", "step_b", "step_c"})
    if (like_recordings) recordings.push_back(read_run(test::null_campaign(std::string(run) + ".csv")));
  const std::vector<PlannedRun> runs = like_recordings ? runs_like(rig, recordings, {}, random) : draw_runs(0.03, random);
  return draw_campaign(rig, hidden, runs, ideal_laboratory(), random);
}

/// An opened campaign, beside the repository.
TrialCampaign recorded(const std::string& name) {
  const std::string folder = test::shared_path("campaigns/open2/" + name + "/");
  TrialCampaign campaign;
  campaign.rig = read_rig(folder + "rig.toml");
  for (const char* run : {"dry_pluck", "wet_pluck", "step_a", "step_b", "step_c"}) campaign.runs.push_back(read_run(folder + run + ".csv"));
  return campaign;
}

Diagnosis verdict_on(const TrialCampaign& campaign, const Strings& candidates) {
  DiagnoseProblem problem;
  problem.rig = campaign.rig;
  problem.runs = campaign.runs;
  problem.verdict_only = true;
  problem.effects = candidates;
  return diagnose(problem);
}

Strings found_in(const Diagnosis& d) {
  Strings found;
  for (const MissingEffect& m : d.missing) found.push_back(m.effect);
  return found;
}

const Candidate* tried(const Diagnosis& d, const Strings& effects) {
  const auto place = std::find_if(d.ranking.begin(), d.ranking.end(), [&](const Candidate& c) { return c.effects == effects; });
  return place == d.ranking.end() ? nullptr : &*place;
}

/// Minutes of search for one campaign each, and under the sanitizers ten times that: on request.
class LongSelection : public testing::Test {
 protected:
  void SetUp() override {
    if (!test::long_tests_wanted()) GTEST_SKIP() << "takes minutes; UNRIG_LONG=1 asks for it";
  }
};

/// A campaign of sample_data, fitted with nothing missing.
struct Fitted {
  explicit Fitted(const std::string& name) : Fitted(problem_of(name)) {}
  explicit Fitted(FitProblem of) : fit(std::move(of)), baseline(fit_baseline(fit)) {
    problem.rig = fit.rig;
    problem.runs = fit.runs;
  }
  static FitProblem problem_of(const std::string& name) {
    const std::string folder = test::source_path("sample_data/campaigns/" + name + "/");
    FitProblem fit;
    fit.rig = read_rig(folder + "rig.toml");
    for (const char* run : {"dry_pluck", "wet_pluck", "step_a", "step_b", "step_c"}) fit.runs.push_back(read_run(folder + run + ".csv"));
    return fit;
  }
  DiagnoseProblem problem;
  FitProblem fit;
  Trial baseline;
};

TEST(Selection, AnEffectWithoutALawIsFoundByItselfWhereItExplainsTheRuns) {
  const auto never = [](const Trial&) { return false; };
  const Fitted wave("wave"), friction("friction");
  const std::optional<Trial> found = Selection(wave.problem, wave.fit, wave.baseline).explained_without_a_law(never, true);
  ASSERT_TRUE(found);
  EXPECT_EQ(found->effects, Strings{"tank-wave"});
  EXPECT_FALSE(what_remains(*found).found);
  EXPECT_FALSE(Selection(friction.problem, friction.fit, friction.baseline).explained_without_a_law(never, true));
}

/// A wave with an amplitude and a phase for every run takes most of what a drag does.
TEST(Selection, ASignalThatStandsInForALawIsChallengedByIt) {
  Fitted drag("drag");
  drag.problem.effects = {"tank-wave", "quadratic-drag"};
  Trial wave = prepare(drag.fit, drag.baseline, {"tank-wave"});
  fit_fully(wave, 6);
  ASSERT_GT(drag.baseline.reduced_chi2(), 10) << "otherwise this tests nothing of mismatches that no two laws explain alike";
  ASSERT_LT(wave.reduced_chi2(), 0.5 * drag.baseline.reduced_chi2());
  EXPECT_EQ(Selection(drag.problem, drag.fit, drag.baseline).challenged(wave).effects, Strings{"quadratic-drag"});
}

/// Within its yield displacement hysteresis is a spring, as the rig is one: no reading tells how large its force could get.
TEST(LawAnswer, AnEffectIsUndeterminedWhereTheRunsTellNothingOfIt) {
  const FitProblem problem = two_decays::problem([](double x, double) { return -0.08 * two_decays::stiffness * x * x * x; });
  const Trial base = fit_baseline(problem);
  Trial spring = prepare(problem, base, {"cubic-stiffness"});
  ASSERT_TRUE(fit_decays_first(spring, base));
  fit_fully(spring, 6);
  EXPECT_FALSE(is_undetermined(problem, spring));
  Trial elastic = prepare(problem, spring, {"cubic-stiffness", "bouc-wen"});
  for (Unknown& u : elastic.arrival.joint.unknowns())
    if (const Parameter& p = elastic.arrival.joint.parameter(u); p.name == "bouc-wen.yield_displacement") u.value = p.upper;
    else if (p.name == "bouc-wen.force") u.value = 1;
  EXPECT_TRUE(is_undetermined(problem, elastic));
}

/// A drag and a spring of much the same size. A wave with an amplitude for every run comes first, and the spring beside it leaves little; only in the wave's place does the drag come in.
TEST_F(LongSelection, TheFirstToBeFoundIsExchangedForWhatItStoodInFor) {
  const TrialCampaign campaign = pair(3002, 5, {"quadratic-drag", "cubic-stiffness"}, false);
  ASSERT_GT(campaign.sizes[0], 30);
  ASSERT_GT(campaign.sizes[1], 30);
  const Diagnosis d = verdict_on(campaign, {"tank-wave", "cubic-stiffness", "quadratic-drag"});
  EXPECT_TRUE(tried(d, {"tank-wave", "cubic-stiffness"})) << "otherwise this campaign tests nothing of the exchange";
  EXPECT_THAT(found_in(d), UnorderedElementsAre("quadratic-drag", "cubic-stiffness"));
  EXPECT_FALSE(d.unexplained);
}

/// Far from the data the spring alone is lost. Beside the friction it is not, and no wave has to stand in for it.
TEST(Selection, ALawThatWasLostFarAwayIsTriedAgainNearTheData) {
  const TrialCampaign campaign = pair(3601, 3, {"coulomb-friction", "cubic-stiffness"}, true);
  ASSERT_GT(campaign.sizes[1], 10);
  const Diagnosis d = verdict_on(campaign, {"tank-wave", "cubic-stiffness", "coulomb-friction"});
  ASSERT_TRUE(tried(d, {"cubic-stiffness"}));
  EXPECT_GT(tried(d, {"cubic-stiffness"})->delta_bic, 0) << "otherwise it was not lost";
  EXPECT_THAT(found_in(d), UnorderedElementsAre("coulomb-friction", "cubic-stiffness"));
  EXPECT_FALSE(d.unexplained);
}

/// From a fit that leaves 155 times the noise a step promises a filter next to nothing.
TEST_F(LongSelection, WhatPromisesNothingIsFittedWhereNothingElseExplainsTheRuns) {
  const TrialCampaign campaign = pair(3502, 28, {"torsion-crosstalk", "gauge-lowpass"}, false);
  ASSERT_LT(campaign.sizes[0], 1) << "below the noise";
  const Diagnosis d = verdict_on(campaign, {"channel-delay", "gauge-lowpass", "tank-wave", "gauge-drift", "mains-hum", "separation-lag", "wagner-lag", "torsion-crosstalk"});  // so many that not all are fitted
  EXPECT_THAT(found_in(d), UnorderedElementsAre("gauge-lowpass"));
  EXPECT_FALSE(d.unexplained);
}

/// With one mode neither friction nor the modes explain a rig of many modes that friction stops.
TEST(Selection, AThinBasisDoesNotHideALaw) {
  const TrialCampaign campaign = pair(3602, 33, {"higher-mode", "coulomb-friction"}, true);
  const Diagnosis d = verdict_on(campaign, {"higher-mode", "coulomb-friction"});
  ASSERT_TRUE(tried(d, {"coulomb-friction"}));
  EXPECT_GT(tried(d, {"coulomb-friction"})->reduced_chi2, 100) << "otherwise friction is found without the modes";
  EXPECT_THAT(found_in(d), UnorderedElementsAre("higher-mode", "coulomb-friction"));
  EXPECT_FALSE(d.unexplained);
}

/// Three per cent of the build-up are replaced (f5). Its exponentials are below the noise, and cost the explanation nothing: with all five parameters counted a separation would be as good.
TEST(Selection, AFaintEffectCountsTheTermsThatItNeeds) {
  UNRIG_NEEDS_SHARED("campaigns/open2");
  const Diagnosis d = verdict_on(recorded("f5"), {"wagner-lag", "separation-lag"});
  EXPECT_THAT(found_in(d), UnorderedElementsAre("wagner-lag"));
  EXPECT_THAT(d.equivalent, testing::IsEmpty());
  ASSERT_TRUE(tried(d, {"wagner-lag"}) && tried(d, {"separation-lag"}));
  EXPECT_LT(tried(d, {"wagner-lag"})->delta_bic, tried(d, {"separation-lag"})->delta_bic - 10);
}

/// From the fit with nothing missing a step promises a filter nothing and a drag too little; what explains the runs instead would get the name.
TEST(Selection, TheFirstThatExplainsTheRunsIsChallengedFromWhereItEnds) {
  UNRIG_NEEDS_SHARED("campaigns/open2");
  const Diagnosis filter = verdict_on(recorded("r3"), {"gauge-lowpass", "channel-delay", "tank-wave", "vortex-shedding", "wagner-lag", "separation-lag", "gauge-drift", "mains-hum"});
  EXPECT_THAT(found_in(filter), testing::ElementsAre("gauge-lowpass"));
  ASSERT_TRUE(tried(filter, {"channel-delay"})) << "otherwise this campaign tests nothing of the challenge";
  EXPECT_LT(tried(filter, {"channel-delay"})->reduced_chi2, explained);

  const Diagnosis drag = verdict_on(recorded("f1"), {"tank-wave", "quadratic-drag"});
  EXPECT_THAT(found_in(drag), testing::ElementsAre("quadratic-drag"));
  ASSERT_TRUE(tried(drag, {"tank-wave"})) << "otherwise this campaign tests nothing of the challenge";
  EXPECT_LT(tried(drag, {"tank-wave"})->reduced_chi2, explained);
}

/// Friction of 5.4 N, sampled at 250 Hz (r4): the search for all runs together loses the wet decay, which it leaves with 15 times the power of its noise.
TEST(Selection, ARunThatALawLostIsFollowedFromWhatTheOthersTell) {
  UNRIG_NEEDS_SHARED("campaigns/open2");
  const Diagnosis d = verdict_on(recorded("r4"), {"coulomb-friction"});
  EXPECT_THAT(found_in(d), testing::ElementsAre("coulomb-friction"));
  EXPECT_FALSE(d.unexplained) << d.remaining.summary;
}

/// A surge takes a tone too, with more parameters in each run, and promises more to first order: it is a law, and those are looked for first.
TEST(Selection, ALawIsChallengedByForcesThatAreNone) {
  const TrialCampaign campaign = pair(3001, 7, {"vortex-shedding"}, true);
  ASSERT_GT(campaign.sizes[0], 1);
  const Diagnosis d = verdict_on(campaign, {});
  EXPECT_THAT(found_in(d), testing::ElementsAre("vortex-shedding"));
  EXPECT_TRUE(tried(d, {"speed-surge"})) << "otherwise this campaign tests nothing of the challenge";
}

/// A friction of 544 times the noise, and hum below it: what following the friction in whole samples leaves had got a slower build-up and a separation, until finer steps left less and the rest no name.
TEST(Selection, WhatIsLeftOfALawIsGivenNoNameThatDoesNotExplainIt) {
  const TrialCampaign campaign = pair(3602, 19, {"coulomb-friction", "mains-hum"}, true);
  ASSERT_LT(campaign.sizes[1], 0.3);
  const Diagnosis d = verdict_on(campaign, {"coulomb-friction", "wagner-lag", "separation-lag"});
  EXPECT_THAT(found_in(d), UnorderedElementsAre("coulomb-friction"));
}

/// Friction of 1.5 N that changes its sign within 0.16 mm/s: what a smoother misses of it by a sample the gauge reads at once.
TEST(Selection, SharpFrictionIsFoundInPlucksAlone) {
  const Rig rig = read_rig(test::null_campaign("rig.toml"));
  const AeroelasticModel model = AeroelasticModel(rig, make_basis(rig, 1000, 998.2), wagner(Wagner::within_1e6)).with_effects({"coulomb-friction"});
  std::mt19937_64 random(1);
  std::normal_distribution<double> normal;
  DiagnoseProblem problem;
  problem.rig = rig;
  problem.verdict_only = true;
  problem.effects = {"coulomb-friction", "wagner-lag", "quadratic-drag"};
  for (const char* name : {"dry_pluck", "wet_pluck"}) {
    const PlannedRun planned = runs_like(rig, {read_run(test::null_campaign(std::string(name) + ".csv"))}, {}, random).front();
    SimulateProblem truth{model, model.start_values(), planned.fine, {}, planned.release, {}};
    truth.theta[model.index("coulomb-friction.force")] = 1.5;
    truth.theta[model.index("coulomb-friction.velocity")] = 1.6e-4;
    truth.law_steps = 8;
    unrig::Run run = every_nth(simulate(truth).run, PlannedRun::finer);
    for (Channel& c : run.channels)
      for (double& reading : c.value) reading += (c.name == "gauge" ? planned.noise : planned.angle_noise) * normal(random);
    problem.runs.push_back(std::move(run));
  }
  const Diagnosis d = diagnose(problem);
  EXPECT_THAT(found_in(d), UnorderedElementsAre("coulomb-friction"));
  EXPECT_FALSE(d.unexplained) << d.remaining.summary;
}

/// Far from the noise a hum is drowned in what friction leaves, and makes its line all the same: it is taken out first, with the friction to be found beside it.
TEST(Selection, AKnownLineIsTakenOutBeforeALawIsLookedFor) {
  const TrialCampaign campaign = pair(3602, 4, {"mains-hum", "coulomb-friction"}, true);
  ASSERT_LT(campaign.sizes[0], 0.1 * campaign.sizes[1]);
  const Diagnosis d = verdict_on(campaign, {"mains-hum", "coulomb-friction"});
  EXPECT_THAT(found_in(d), testing::ElementsAre("mains-hum", "coulomb-friction")) << "in this order";
  EXPECT_FALSE(d.unexplained);
}

/// The decays beside a gap are not followed while a hum of two and a half times the noise is in them.
TEST_F(LongSelection, AGapIsFoundBesideAHum) {
  UNRIG_NEEDS_SHARED("campaigns/open2");
  EXPECT_THAT(found_in(verdict_on(recorded("a7"), {"freeplay", "mains-hum", "coulomb-friction"})), UnorderedElementsAre("freeplay", "mains-hum"));
}

/// The decays cross the corners for seconds, and are explained by a law that is trusted to within some per cent; the steps are followed to the noise from what the decays tell.
TEST_F(LongSelection, StepsOfARigWithAGapAreFollowedToTheNoise) {
  const Diagnosis d = verdict_on(pair(3902, 5, {"freeplay"}, true), {"freeplay", "coulomb-friction", "wagner-lag"});
  EXPECT_THAT(found_in(d), UnorderedElementsAre("freeplay"));
  EXPECT_FALSE(d.unexplained) << d.remaining.summary;
}

/// BIC of 2 ln 3 more is a third as probable.
TEST(Ranking, GivesNothingToWhatWouldHaveWonAndWasNotNamed) {
  const double third = 2 * std::log(3.0);
  std::vector<Candidate> ranking(4);
  ranking[0].effects = {"rig-description"}, ranking[0].delta_bic = -200;
  ranking[1].effects = {"tank-wave", "mains-hum"}, ranking[1].delta_bic = -100;
  ranking[2].effects = {"gauge-drift"}, ranking[2].delta_bic = -100 + third;
  ranking[3].delta_bic = 0;
  for (Candidate& c : ranking) c.probability = 0.25;
  std::vector<Candidate> other = ranking;
  leave_out_what_explains_nothing({"mains-hum", "tank-wave"}, {}, ranking);
  EXPECT_EQ(ranking[0].probability, 0);
  EXPECT_NEAR(ranking[1].probability, 0.75, 1e-12);
  EXPECT_NEAR(ranking[2].probability, 0.25, 1e-12);
  leave_out_what_explains_nothing({"channel-delay"}, {}, other);
  EXPECT_EQ(other[0].probability, 0.25) << "as it was: no set of the ranking";
  leave_out_what_explains_nothing({"gauge-drift"}, {{"tank-wave", "mains-hum"}}, other);
  EXPECT_EQ(other[0].probability, 0);
  EXPECT_NEAR(other[1].probability, 0.75, 1e-12) << "a rival that these runs do not refute";
  EXPECT_NEAR(other[2].probability, 0.25, 1e-12);
}

}  // namespace
}  // namespace unrig
