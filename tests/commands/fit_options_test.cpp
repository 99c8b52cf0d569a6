// `unrig fit` where the answer is not a plain number: what is determined instead, profile likelihood, start values, a model that does not explain a run.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <string>

#include <nlohmann/json.hpp>

#include "core/files/text_file.h"
#include "tests/commands/run_unrig.h"
#include "tests/support/sample_data.h"

namespace unrig {
namespace {

using nlohmann::json;
using test::Finished;
using test::run_unrig;
using test::TemporaryDirectory;
using ::testing::HasSubstr;

constexpr double pi = 3.14159265358979, frequency = 4.8, damping = 0.03, mass = 2, noise = 0.05;
const double stiffness = mass * std::pow(2 * pi * frequency, 2) * (1 + damping * damping);  // |pole|^2 m

/// A free decay of one mode, with a tone that no rig explains.
std::string decay(const TemporaryDirectory& directory, double tone = 0) {
  std::mt19937 random(7);
  std::normal_distribution<double> normal;
  std::string text = "# unrig_run = 1\n# kind = \"pluck\"\n# density = \"1.2 kg/m^3\"\n# speed = \"0 m/s\"\ntime [s],gauge [N]\n";
  for (int k = 0; k < 1000; ++k) {
    const double t = 0.005 * k, w = 2 * pi * frequency;
    text += std::to_string(t) + "," + std::to_string(10 * std::exp(-damping * w * t) * std::cos(w * t) + noise * normal(random) + tone * std::sin(2 * pi * 17 * t)) + "\n";
  }
  return directory.file("run.csv", text);
}

std::string rig_file(const TemporaryDirectory& directory) {
  return directory.file("rig.toml", "unrig_rig = 1\nname = \"spring\"\n[[modal]]\nmass = \"2 kg\"\nfrequency = \"5 Hz\"\ndamping_ratio = 0.02\ngauge_gain = \"1000 N/m\"\n");
}

Finished fit_of(const TemporaryDirectory& directory, const std::string& run, const std::vector<std::string>& more) {
  std::vector<std::string> arguments{"fit", "--rig", rig_file(directory), run, "-o", directory.path("fit.json")};
  arguments.insert(arguments.end(), more.begin(), more.end());
  return run_unrig(directory, arguments);
}

TEST(FitOptions, AStartBeyondItsBoundsAndAnEffectThatTheRigCannotHaveAreRefused) {
  const TemporaryDirectory directory;
  const Finished start = fit_of(directory, decay(directory), {"--start", "modal[1].stiffness=-1"});
  EXPECT_EQ(start.status, 2);
  EXPECT_THAT(start.err, HasSubstr("wanted a value from"));
  const Finished effect = fit_of(directory, decay(directory), {"--effect", "tank-wave"});
  EXPECT_EQ(effect.status, 2);
  EXPECT_THAT(effect.err, testing::AllOf(HasSubstr("--effect: tank-wave"), HasSubstr("needs a beam rig; this one is known only as modes")));
}

TEST(FitOptions, WhatIsDeterminedIsGivenWhereAParameterIsNot) {
  const TemporaryDirectory directory;
  const Finished finished = fit_of(directory, decay(directory), {});
  ASSERT_EQ(finished.status, 0) << finished.err;
  const json fit = json::parse(read_text(directory.path("fit.json")));
  ASSERT_EQ(fit["determined"].size(), 2u);
  const json& ratio = fit["determined"][0];
  EXPECT_EQ(ratio["combination"], "modal[1].stiffness / modal[1].mass");
  EXPECT_NEAR(ratio["value"].get<double>(), stiffness / mass, 3.5 * ratio["std_error"].get<double>());
  EXPECT_LT(ratio["std_error"], 1e-3 * stiffness / mass);
  EXPECT_THAT(ratio["settled_by"].get<std::string>(), HasSubstr("measured force"));
  EXPECT_THAT(finished.out, HasSubstr("[[Determined]]\n    modal[1].stiffness / modal[1].mass = "));
  for (const json& p : fit["parameters"]) EXPECT_EQ(p["identified"], false) << p;
  EXPECT_EQ(finished.err.find("does not explain"), std::string::npos) << finished.err;
}

TEST(FitOptions, ProfileLikelihoodOfWhatIsAskedFor) {
  const TemporaryDirectory directory;
  const std::string run = decay(directory);
  const Finished one = fit_of(directory, run, {"--profile", "modal[1].stiffness"});
  ASSERT_EQ(one.status, 0) << one.err;
  const json fit = json::parse(read_text(directory.path("fit.json")));
  ASSERT_EQ(fit["profile"].size(), 1u);
  EXPECT_EQ(fit["profile"][0]["name"], "modal[1].stiffness");
  double error = 0;
  for (const json& p : fit["parameters"])
    if (p["name"] == "modal[1].stiffness") error = p["std_error"];
  const json &likely = fit["profile"][0]["intervals"][0], &usual = fit["profile"][0]["intervals"][1];
  // Frequencies are all but linear: the profile is the standard error, to the hundredth of one that a fit is searched to, twice.
  EXPECT_NEAR((likely["upper"].get<double>() - likely["lower"].get<double>()) / (2 * error), 1, 0.02);
  EXPECT_NEAR((usual["upper"].get<double>() - usual["lower"].get<double>()) / (2 * 1.959964 * error), 1, 0.02);
  EXPECT_THAT(one.out, HasSubstr("[[Profile likelihood]]"));

  ASSERT_EQ(fit_of(directory, run, {"--profile"}).status, 0);
  EXPECT_EQ(json::parse(read_text(directory.path("fit.json")))["profile"].size(), 2u) << "the mass is held";
}

TEST(FitOptions, RunsMayStandBehindProfile) {
  const TemporaryDirectory directory;
  const std::string run = decay(directory), rig = rig_file(directory), out = directory.path("fit.json");
  ASSERT_EQ(run_unrig(directory, {"fit", "--rig", rig, "-o", out, "--profile", run}).status, 0);
  EXPECT_EQ(json::parse(read_text(out))["profile"].size(), 2u) << "all, as without a name";
  ASSERT_EQ(run_unrig(directory, {"fit", "--rig", rig, "-o", out, "--profile", "modal[1].stiffness", run}).status, 0);
  EXPECT_EQ(json::parse(read_text(out))["profile"].size(), 1u);
  const Finished none = run_unrig(directory, {"fit", "--rig", rig, "-o", out, "--profile", "modal[1].stiffness"});
  EXPECT_EQ(none.status, 2);
  EXPECT_THAT(none.err, HasSubstr("runs is required"));
}

TEST(FitOptions, ProfileOfAParameterThatNothingDeterminesHasNoEnd) {
  const TemporaryDirectory directory;
  ASSERT_EQ(fit_of(directory, decay(directory), {"--profile", "modal[1].mass"}).status, 0);
  const json fit = json::parse(read_text(directory.path("fit.json")));
  // Stiffness and damping follow the mass as far as their bounds let them: the ends are those of the bounds, far away.
  const json& usual = fit["profile"][0]["intervals"][1];
  EXPECT_TRUE(usual["upper"].is_null() || usual["upper"] > 100 * mass) << usual;
  EXPECT_TRUE(usual["lower"].is_null() || usual["lower"] < 0.01 * mass) << usual;
}

TEST(FitOptions, StartValuesAreReportedAsTheyWereGiven) {
  const TemporaryDirectory directory;
  ASSERT_EQ(fit_of(directory, decay(directory), {"--start", "modal[1].stiffness=1700"}).status, 0);
  const json fit = json::parse(read_text(directory.path("fit.json")));
  EXPECT_EQ(fit["parameters"][1]["name"], "modal[1].stiffness");
  EXPECT_EQ(fit["parameters"][1]["start"], 1700);
}

TEST(FitOptions, MayStandBeforeTheRuns) {
  const TemporaryDirectory directory;
  const std::string run = decay(directory), rig = rig_file(directory);
  const Finished fitted = run_unrig(directory, {"fit", "--rig", rig, "--start", "modal[1].damping=1", run, "-o", directory.path("fit.json")});
  EXPECT_EQ(fitted.status, 0) << fitted.err;
  const Finished diagnosed = run_unrig(directory, {"diagnose", "--rig", rig, "--heldout", decay(directory), "--effects", "mains-hum,cubic-stiffness", run, "-o", directory.path("diagnosis.json")});
  EXPECT_THAT(diagnosed.err, HasSubstr("--heldout is among the runs too")) << "one value each; the rest are runs";
}

TEST(FitOptions, AnEffectThatIsNamedTwiceActsOnce) {
  const TemporaryDirectory directory;
  const std::string run = decay(directory);
  ASSERT_EQ(fit_of(directory, run, {"--effect", "quadratic-drag"}).status, 0);
  const json once = json::parse(read_text(directory.path("fit.json")));
  ASSERT_EQ(fit_of(directory, run, {"--effect", "quadratic-drag", "--effect", "quadratic-drag"}).status, 0);
  const json twice = json::parse(read_text(directory.path("fit.json")));
  EXPECT_EQ(twice["effects"].size(), 1u);
  EXPECT_EQ(twice["parameters"], once["parameters"]);
}

TEST(FitOptions, NamesThatNoParameterHasAreRefused) {
  const TemporaryDirectory directory;
  for (const auto& [option, value] : {std::pair{"--start", "modal[2].mass=1"}, {"--profile", "stiffness"}}) {
    const Finished finished = fit_of(directory, decay(directory), {option, value});
    EXPECT_EQ(finished.status, 2);
    EXPECT_THAT(finished.err, ::testing::AllOf(HasSubstr(option), HasSubstr("modal[1].stiffness")));
  }
}

TEST(FitOptions, ARunThatTheModelDoesNotExplainIsNamed) {
  const TemporaryDirectory directory;
  const Finished finished = fit_of(directory, decay(directory, 10 * noise), {});
  EXPECT_EQ(finished.status, 0);
  EXPECT_THAT(finished.err, ::testing::AllOf(HasSubstr("run.csv: the model does not explain this run"), HasSubstr("gauge is left with")));
  EXPECT_FALSE(json::parse(read_text(directory.path("fit.json")))["warnings"].empty());
}

TEST(FitOptions, ARunThatTheModelDoesNotFollowIsNoAnswer) {
  const TemporaryDirectory directory;
  std::string text = "# unrig_run = 1\n# kind = \"pluck\"\n# density = \"1.2 kg/m^3\"\n# speed = \"0 m/s\"\ntime [s],gauge [N]\n";
  for (int k = 0; k < 1000; ++k) {  // three tones alike: one mode can follow a third
    const double t = 0.005 * k;
    text += std::to_string(t) + "," + std::to_string(std::sin(2 * pi * 3 * t) + std::sin(2 * pi * 7 * t) + std::sin(2 * pi * 17 * t)) + "\n";
  }
  const Finished finished = fit_of(directory, directory.file("run.csv", text), {});
  EXPECT_EQ(finished.status, 1);
  EXPECT_THAT(finished.err, ::testing::AllOf(HasSubstr("no trustworthy answer: "), HasSubstr("run.csv: the model follows only")));
  const json fit = json::parse(read_text(directory.path("fit.json")));
  EXPECT_THAT(fit["no_answer"].get<std::string>(), HasSubstr("run.csv"));
  EXPECT_EQ(fit["runs"][0]["explained"], false);
  EXPECT_NEAR(fit["runs"][0]["followed"].get<double>(), 1. / 3, 0.02);
  for (const json& p : fit["parameters"]) EXPECT_EQ(p["identified"], false) << p;
}

TEST(FitOptions, ADecayInALongRecordOfColouredNoiseIsAnAnswer) {
  const TemporaryDirectory directory;
  std::mt19937 random(7);
  std::normal_distribution<double> normal;
  std::string text = "# unrig_run = 1\n# kind = \"pluck\"\n# density = \"1.2 kg/m^3\"\n# speed = \"0 m/s\"\ntime [s],gauge [N]\n";
  double coloured = 0;
  for (int k = 0; k < 60000; ++k) {
    const double t = 0.005 * k, w = 2 * pi * frequency;
    coloured = 0.9 * coloured + 0.3 * normal(random);  // standard deviation 0.69 N, differences say a fifth of that
    text += std::to_string(t) + "," + std::to_string(10 * std::exp(-damping * w * t) * std::cos(w * t) + coloured) + "\n";
  }
  const Finished finished = fit_of(directory, directory.file("run.csv", text), {});
  EXPECT_EQ(finished.status, 0) << finished.err;
  const json fit = json::parse(read_text(directory.path("fit.json")));
  EXPECT_EQ(fit["runs"][0]["explained"], false);
  EXPECT_GT(fit["runs"][0]["followed"], 0.9) << "of all of it only a tenth";
  const json& ratio = fit["determined"][0];
  EXPECT_NEAR(ratio["value"].get<double>(), stiffness / mass, 3.5 * ratio["std_error"].get<double>());
}

/// The first lines of a decay.
std::string beginning(const TemporaryDirectory& directory, int samples) {
  const std::string text = read_text(decay(directory));
  std::size_t end = 0;
  for (int line = 0; line < 5 + samples; ++line) end = text.find('\n', end) + 1;
  return directory.file("run.csv", text.substr(0, end));
}

TEST(FitOptions, ARunOfFewSamplesIsRefused) {
  const TemporaryDirectory directory;
  const Finished three = fit_of(directory, beginning(directory, 3), {});
  EXPECT_EQ(three.status, 2);
  EXPECT_THAT(three.err, ::testing::AllOf(HasSubstr("run.csv: 3 samples for 3 unknowns of the run itself"), HasSubstr("Record for several periods")));
  const Finished some = fit_of(directory, beginning(directory, 20), {});
  EXPECT_EQ(some.status, 1);
  EXPECT_THAT(some.err, ::testing::AllOf(HasSubstr("no trustworthy answer: 20 samples leave"), HasSubstr("Record for several periods")));
  const json fit = json::parse(read_text(directory.path("fit.json")));
  for (const json& p : fit["parameters"]) EXPECT_EQ(p["identified"], false) << p;
  EXPECT_EQ(fit_of(directory, beginning(directory, 200), {}).status, 0) << "five periods";
}

/// Beside longer ones a run of seven rows was taken without a word, and its slope printed as fixed.
TEST(FitOptions, ARunThatIsTooShortToSayAnythingIsNamed) {
  const TemporaryDirectory directory;
  const std::string text = read_text(test::null_campaign("step_a.csv"));
  std::size_t end = 0;
  for (int line = 0; line < 7 + 7; ++line) end = text.find('\n', end) + 1;
  const std::string shorter = directory.file("short.csv", text.substr(0, end));
  const Finished finished = run_unrig(directory, {"fit", "--rig", test::null_campaign("rig.toml"), test::null_campaign("wet_pluck.csv"), shorter, "-o", directory.path("fit.json")});
  EXPECT_EQ(finished.status, 0) << finished.err;
  EXPECT_THAT(finished.err, HasSubstr("short.csv: the run is too short to say anything by itself: 7 samples leave"));
}

}  // namespace
}  // namespace unrig
