#include "fit/diagnose/rig_description.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include <nlohmann/json.hpp>

#include "core/rig/givens.h"
#include "fit/diagnose/description_beside.h"
#include "fit/diagnose/diagnosis_files.h"
#include "fit/diagnose/selection.h"
#include "tests/support/sample_data.h"
#include "fit/search/noise_of_trial.h"

namespace unrig {
namespace {

using ::testing::HasSubstr;

const std::string campaigns = std::string(UNRIG_SOURCE_DIR) + "/sample_data/campaigns/";

DiagnoseProblem campaign(const std::string& name) {
  DiagnoseProblem problem;
  problem.rig = read_rig(campaigns + name + "/rig.toml");
  for (const char* run : {"dry_pluck", "wet_pluck", "step_a", "step_b", "step_c"}) problem.runs.push_back(read_run(campaigns + name + "/" + run + ".csv"));
  return problem;
}

/// The null campaign with a rig file whose chord is 1 % too long.
DiagnoseProblem with_a_long_chord() {
  DiagnoseProblem problem = campaign("null");
  problem.rig.chord *= 1.01;
  return problem;
}

Trial baseline_of(const FitProblem& problem) { return fit_baseline(problem); }

FitProblem fit_of(const DiagnoseProblem& problem) {
  FitProblem fit;
  fit.rig = problem.rig;
  fit.runs = problem.runs;
  fit.circulation = problem.circulation;
  return fit;
}

TEST(RigDescription, PutsAWrongChordRight) {
  const DiagnoseProblem problem = with_a_long_chord();
  const FitProblem fit = fit_of(problem);
  const Trial baseline = baseline_of(fit);
  ASSERT_TRUE(what_remains(baseline).found);
  const std::optional<RigDescription> description = describe_rig(problem, baseline);
  ASSERT_TRUE(description);
  EXPECT_FALSE(what_remains(description->trial).found);
  EXPECT_LT(bic_difference(description->trial, baseline) + description->cost, -decisive);
  EXPECT_GT(description->cost, 0);
  for (const FittedGiven& g : description->numbers) {
    EXPECT_TRUE(std::isfinite(g.std_error)) << g.name;
    EXPECT_LE(g.std_error, 1.1 * g.stated_std) << g.name;
  }
}

/// Most of what white noise does not explain is no mismatch then, and no number of the rig takes it.
TEST(RigDescription, IsFoundInNoiseOfAColour) {
  DiagnoseProblem problem = campaign("null");
  problem.rig.normal.inertia[12] *= 1.05;
  constexpr double corner = 5, sigma = 0.03;  // Hz, N
  std::mt19937_64 random(1);
  std::normal_distribution<double> normal;
  for (unrig::Run& run : problem.runs) {
    Eigen::VectorXd& gauge = std::find_if(run.channels.begin(), run.channels.end(), [](const Channel& c) { return c.name == "gauge"; })->value;
    const double pole = std::exp(-2 * std::numbers::pi * corner * run.dt);
    double noise = sigma * normal(random);
    for (double& reading : gauge) reading += noise, noise = pole * noise + std::sqrt(1 - pole * pole) * sigma * normal(random);
  }
  const FitProblem fit = fit_of(problem);
  const Trial baseline = baseline_of(fit);
  Trial in_colour = baseline;
  ASSERT_FALSE(explained_by_noise(in_colour));
  const std::optional<RigDescription> description = describe_rig(problem, baseline);
  ASSERT_TRUE(description);
  ASSERT_TRUE(description->from);
  EXPECT_TRUE(has_colour(description->from->arrival.joint));
  EXPECT_FALSE(what_remains(description->trial).found);
  EXPECT_LT(bic_difference(description->trial, *description->from) + description->cost, -decisive);
}

/// Numbers that are far off are found in many steps, of which the first promises most of what the wave leaves, and not all.
TEST(DescriptionBeside, IsSearchedWhereAStepPromisesMostOfWhatASetLeaves) {
  DiagnoseProblem problem = campaign("wave");
  problem.rig.normal.inertia[12] *= 1.3;
  const FitProblem fit = fit_of(problem);
  Trial wave = prepare(fit, baseline_of(fit), {"tank-wave"});
  fit_fully(wave, 6);
  ASSERT_GT(wave.reduced_chi2(), 2);
  DescriptionBeside beside(problem);
  const std::optional<RigDescription>& description = beside.explains(wave);
  ASSERT_TRUE(description);
  EXPECT_LT(description->promised, enough_to_name);
  EXPECT_LT(description->left, explained);
}

TEST(RigDescription, DoesNotExplainAFilterInTheGauge) {
  const DiagnoseProblem problem = campaign("lowpass");
  const FitProblem fit = fit_of(problem);
  const std::optional<RigDescription> description = describe_rig(problem, baseline_of(fit));
  EXPECT_TRUE(!description || what_remains(description->trial).found);
}

TEST(RigDescription, IsTheVerdictOnAWrongChordAndSaysWhatToDo) {
  DiagnoseProblem problem = with_a_long_chord();
  problem.effects = {"tank-wave", "wagner-lag"};
  problem.heldout.push_back(read_run(campaigns + "null/heldout.csv"));
  const Diagnosis d = diagnose(problem);
  ASSERT_EQ(d.missing.size(), 1u);
  const MissingEffect& m = d.missing.front();
  EXPECT_EQ(m.effect, rig_description_id);
  EXPECT_FALSE(d.unexplained);
  EXPECT_TRUE(m.source.empty());
  ASSERT_FALSE(m.parameters.empty());
  EXPECT_TRUE(std::any_of(d.ranking.begin(), d.ranking.end(), [](const Candidate& c) { return c.effects == std::vector<std::string>{rig_description_id}; }));
  EXPECT_TRUE(d.after.effects.empty());
  EXPECT_TRUE(d.after.givens.empty());
  EXPECT_EQ(d.after.rig_fingerprint, d.before.rig_fingerprint);
  EXPECT_THAT(report(d), HasSubstr("Missing is nothing but an exact rig file"));
  EXPECT_THAT(report(d), HasSubstr("std_percent"));
  const nlohmann::json json = nlohmann::json::parse(to_json(d));
  EXPECT_EQ(json["missing"][0]["effect"], rig_description_id);
  EXPECT_TRUE(json["missing"][0]["parameters"][0].contains("stated"));
  for (const ImprovedRun& run : d.runs) EXPECT_LT(std::pow(run.rms_after / run.noise, 2), 1.2) << run.file;
}

TEST(RigDescription, IsNoCandidateBesideStatedUncertainties) {
  DiagnoseProblem problem = with_a_long_chord();
  problem.effects = {"tank-wave"};
  problem.verdict_only = true;
  auto givens = std::make_shared<Givens>();
  givens->numbers = {{GivenNumber::pitch_axis, -1, -1, "section.pitch_axis", "1", problem.rig.pitch_axis, 1e-6}};
  givens->spread = Eigen::MatrixXd::Constant(1, 1, 1e-6);
  givens->group = {"section.pitch_axis"};
  givens->common = {true};
  problem.rig.givens = givens;
  const Diagnosis d = diagnose(problem);
  for (const MissingEffect& m : d.missing) EXPECT_NE(m.effect, rig_description_id);
  for (const Candidate& c : d.ranking) EXPECT_FALSE(std::count(c.effects.begin(), c.effects.end(), rig_description_id));
}

}  // namespace
}  // namespace unrig
