#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <nlohmann/json.hpp>
#include <numbers>
#include <random>

#include "core/model/simulate.h"
#include "core/numerics/spectrum.h"
#include "core/files/text_file.h"
#include "fit/diagnose/diagnose.h"
#include "fit/diagnose/diagnosis_files.h"
#include "tests/fit/one_mode.h"

namespace unrig {
namespace {

using testing::HasSubstr;
using testing::Not;

const std::string campaigns = std::string(UNRIG_SOURCE_DIR) + "/sample_data/campaigns/";

DiagnoseProblem fitted_runs(const std::string& name) {
  DiagnoseProblem problem;
  problem.rig = read_rig(campaigns + name + "/rig.toml");
  for (const char* run : {"dry_pluck", "wet_pluck", "step_a", "step_b", "step_c"}) problem.runs.push_back(read_run(campaigns + name + "/" + run + ".csv"));
  return problem;
}

Diagnosis diagnose_campaign(const std::string& name, const std::function<void(const std::string&)>& progress = {}) {
  DiagnoseProblem problem = fitted_runs(name);
  problem.progress = progress;
  problem.heldout.push_back(read_run(campaigns + name + "/heldout.csv"));
  return diagnose(problem);
}

/// The verdict of the key, parameters within three standard errors of it, fitted and held-out runs down to the noise of the key (reduced chi-square at most 1.2:
/// the bounds that the project promises).
void expect_verdict(const std::string& name, const std::map<std::string, double>& truth, const std::function<void(const std::string&)>& progress = {}) {
  const nlohmann::json key = nlohmann::json::parse(read_text(campaigns + "KEY.json"))[name];
  const Diagnosis d = diagnose_campaign(name, progress);
  std::vector<std::string> found;
  for (const MissingEffect& m : d.missing) found.push_back(m.effect);
  EXPECT_EQ(found, key["effects"].get<std::vector<std::string>>());
  EXPECT_EQ(d.mismatch.found, !found.empty());
  EXPECT_FALSE(d.unexplained);
  for (const MissingEffect& m : d.missing)
    for (const FittedParameter& p : m.parameters)
      if (const auto known = truth.find(p.name); known != truth.end()) {
        EXPECT_LT(std::abs(p.value - known->second), 3 * p.std_error) << p.name << " " << p.value << " +/- " << p.std_error;
      }
  ASSERT_EQ(d.runs.size(), 6u);
  for (const ImprovedRun& run : d.runs) {
    const double sigma = key["runs"].begin().value()["sigma"];
    EXPECT_LT(std::pow(run.rms_after / sigma, 2), 1.2) << run.file;
  }
}

TEST(Diagnose, NothingIsMissingFromNull) { expect_verdict("null", {}); }
TEST(Diagnose, FindsTheTankWave) {
  const nlohmann::json wave = nlohmann::json::parse(read_text(campaigns + "KEY.json"))["wave"]["parameters"]["wave"];
  std::string told;
  expect_verdict("wave", {{"tank-wave.frequency", wave["hz"]}, {"tank-wave.decay_time", wave["tau"]}}, [&](const std::string& what) { told += what + "\n"; });
  EXPECT_THAT(told, Not(HasSubstr("looking for a law"))) << "which is dear, and too large a mismatch for one to explain as well";
}
TEST(Diagnose, FindsTheLowpass) {
  expect_verdict("lowpass", {{"gauge-lowpass.cutoff", nlohmann::json::parse(read_text(campaigns + "KEY.json"))["lowpass"]["parameters"]["cutoff_hz"]}});
}
/// Without the decay in air a step promises the filter nothing, and no law of the list explains these runs.
TEST(Diagnose, FindsALowpassOfWhichAStepPromisesNothing) {
  DiagnoseProblem problem = fitted_runs("lowpass");
  std::erase_if(problem.runs, [](const unrig::Run& run) { return run.file.find("dry") != std::string::npos || run.file.find("step_c") != std::string::npos; });
  ASSERT_EQ(problem.runs.size(), 3u);
  problem.verdict_only = true;
  const Diagnosis d = diagnose(problem);
  ASSERT_EQ(d.missing.size(), 1u);
  EXPECT_EQ(d.missing.front().effect, "gauge-lowpass");
  EXPECT_FALSE(d.unexplained);
  EXPECT_FALSE(d.stopped);
}
TEST(Diagnose, FindsTheHigherModes) { expect_verdict("highermode", {}); }
TEST(Diagnose, FindsTheQuadraticDrag) {
  expect_verdict("drag", {{"quadratic-drag.coefficient", nlohmann::json::parse(read_text(campaigns + "KEY.json"))["drag"]["parameters"]["drag_coefficient"]}});
}
TEST(Diagnose, FindsTheDryFriction) { expect_verdict("friction", {}); }

TEST(Diagnose, WithoutAHeldOutRunEachIsPredictedFromTheOthers) {
  DiagnoseProblem problem = fitted_runs("wave");
  problem.effects = {"tank-wave", "gauge-drift"};
  const Diagnosis d = diagnose(problem);
  ASSERT_EQ(d.missing.size(), 1u);
  int left_out = 0, steps = 0;
  for (const ImprovedRun& run : d.runs) {
    if (!run.left_out) continue;
    ++left_out;
    if (run.file.find("step") == std::string::npos) continue;  // a decay's own amplitudes take up some of the wave, and no other run is in air
    ++steps;
    EXPECT_GT(run.rms_before, 2 * run.noise) << run.file;
    EXPECT_LT(run.rms_after, 1.1 * run.noise) << run.file << ": a reduced chi-square of 1.2";
  }
  EXPECT_EQ(left_out, 5);
  EXPECT_EQ(steps, 3);
}

/// The wave's name withheld: nothing else may be named, and the force that would explain what is left swings at the wave's frequency.
TEST(Diagnose, WhatNoCandidateExplainsIsGivenAsAForce) {
  DiagnoseProblem problem = fitted_runs("wave");
  problem.effects = {"gauge-drift", "torsion-crosstalk", "gauge-lowpass"};
  const Diagnosis d = diagnose(problem);
  EXPECT_TRUE(d.missing.empty());
  EXPECT_TRUE(d.unexplained);
  const double hz = nlohmann::json::parse(read_text(campaigns + "KEY.json"))["wave"]["parameters"]["wave"]["hz"];
  const auto step = std::find_if(d.missing_force.begin(), d.missing_force.end(), [](const MissingForce& f) { return f.run.ends_with("step_a.csv"); });
  ASSERT_NE(step, d.missing_force.end());
  Eigen::Index line = 0;
  const double line_hz = 1 / (step->dt * static_cast<double>(step->value.size()));
  fourier(Eigen::VectorXd(step->value.array() - step->value.mean())).cwiseAbs().maxCoeff(&line);
  EXPECT_NEAR(static_cast<double>(line) * line_hz, hz, line_hz) << "the record's own resolution";
  EXPECT_GT(step->value.norm() / std::sqrt(static_cast<double>(step->value.size())), 3 * step->standard_deviation);
}

/// Section 4.2.3 of the seed: below one semichord its recording swings at another frequency than its analysis with one normal and one torsional mode. Its own step, read with all modes and
/// noise, is told from that analysis (the second mode lies at 15.1 Hz). open/highermode, from a simulator of others, is the independent proof.
TEST(Diagnose, TheSeedsRiddleIsAHigherMode) {
  const std::string seed = std::string(UNRIG_SOURCE_DIR) + "/sample_data/seed/";
  DiagnoseProblem problem;
  problem.rig = read_rig(seed + "rig.toml");
  problem.verdict_only = true;
  Rig whole = problem.rig;
  whole.normal.modes = 8;
  const unrig::Run motion = read_run(seed + "step.csv");
  const AeroelasticModel model(whole, make_basis(whole, Eigen::Index{8}, Eigen::Index{1}), wagner(Wagner::within_1e6));
  unrig::Run run = simulate({model, model.start_values(), motion, PitchBetweenSamples::spline, std::nullopt, std::nullopt}).run;
  std::erase_if(run.channels, [](const Channel& c) { return c.name != "alpha" && c.name != "gauge"; });
  std::mt19937_64 random(1);
  std::normal_distribution<double> normal;
  for (Channel& c : run.channels)
    for (double& x : c.value) x += (c.name == "alpha" ? 0.01 * std::numbers::pi / 180 : 0.03) * normal(random);
  problem.runs.push_back(run);
  const Diagnosis d = diagnose(problem);
  ASSERT_EQ(d.missing.size(), 1u);
  EXPECT_EQ(d.missing.front().effect, "higher-mode");
  EXPECT_FALSE(d.unexplained);
  ASSERT_EQ(d.mismatch.frequency.size(), 1u);
  EXPECT_NEAR(d.mismatch.frequency.front()[1], 15.1, 1) << "where most of the excess ends; 1.6 s resolve 0.6 Hz";
}

/// The drag's name withheld: a decaying tone at the rig's own frequency, with an amplitude for every run, takes nearly all of what a drag does, and is no wave.
TEST(Diagnose, ASignalThatLeavesAMismatchIsNotNamed) {
  DiagnoseProblem problem = fitted_runs("drag");
  problem.effects = {"tank-wave", "gauge-drift"};
  problem.verdict_only = true;
  const Diagnosis d = diagnose(problem);
  EXPECT_TRUE(d.missing.empty());
  EXPECT_TRUE(d.unexplained);
  ASSERT_EQ(d.closest.size(), 1u);
  EXPECT_EQ(d.closest.front().effect, "tank-wave");
  EXPECT_GT(d.removed_by_closest, enough_to_name);
  EXPECT_EQ(d.naming, Naming::only_signals);
}

/// Noise that a filter has kept from the end of the spectrum: differences of the readings tell less of it than there is.
TEST(Diagnose, NothingIsMissingInNoiseBehindAFilterAgainstAliasing) {
  constexpr Eigen::Index samples = 4000;
  for (const unsigned seed : {1u, 2u, 3u}) {
    DiagnoseProblem problem;
    problem.rig = one_mode::rig();
    for (const unsigned run : {0u, 1u}) problem.runs.push_back(one_mode::decay("decay_" + std::to_string(run) + ".csv", 5 * one_mode::free_response(samples, one_mode::hertz).col(run) + 0.03 * one_mode::decimated_noise(samples, 2 * seed + run)));
    const Diagnosis d = diagnose(problem);
    EXPECT_TRUE(d.missing.empty()) << seed;
    EXPECT_FALSE(d.unexplained) << seed << ": " << d.remaining.summary;
    for (const ImprovedRun& run : d.runs) EXPECT_NEAR(run.noise, 0.03, 0.002) << seed << ": of 4000 samples 1 %";
  }
}

TEST(DiagnosisFile, HasWhatTheFormatPromises) {
  const nlohmann::json json = nlohmann::json::parse(to_json(diagnose_campaign("null")));
  EXPECT_EQ(json["unrig"], "diagnosis");
  for (const char* key : {"mismatch", "missing", "explanations", "holds", "equivalent", "unexplained", "improvement"}) EXPECT_TRUE(json.contains(key)) << key;
  for (const char* key : {"found", "p_value", "runs", "time", "frequency", "summary"}) EXPECT_TRUE(json["mismatch"].contains(key)) << key;
  for (const auto& run : json["improvement"]["runs"])
    for (const char* key : {"file", "heldout", "rms_before", "rms_after", "noise", "unit"}) EXPECT_TRUE(run.contains(key)) << key;
  EXPECT_TRUE(json["missing"].empty());
}

}  // namespace
}  // namespace unrig
