// `--law`: a law in a file, from fit to simulation; the fit carries it, and one that has changed is said.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <random>
#include <string>

#include <nlohmann/json.hpp>

#include "core/files/text_file.h"
#include "tests/commands/run_unrig.h"

namespace unrig {
namespace {

using nlohmann::json;
using test::Finished;
using test::run_unrig;
using test::TemporaryDirectory;
using ::testing::AllOf;
using ::testing::Gt;
using ::testing::HasSubstr;
using ::testing::Lt;
using ::testing::Not;

const std::string law = "unrig_law = 1\nname = \"drag\"\nacts_on = \"normal\"\nforce = \"-c * abs(v) * v\"\n[parameters]\nc = { start = \"5 N.s^2/m^2\", lower = \"0 N.s^2/m^2\" }\n";

/// A decay of m q'' + k q + 30 |q'| q' = 0, 2 kg at about 5 Hz, by small symplectic steps.
std::string decay(const TemporaryDirectory& directory) {
  std::mt19937 random(7);
  std::normal_distribution<double> normal;
  std::string text = "# unrig_run = 1\n# kind = \"pluck\"\n# density = \"1.2 kg/m^3\"\n# speed = \"0 m/s\"\ntime [s],gauge [N]\n";
  double q = 0.02, v = 0;
  constexpr int finer = 200;
  const double dt = 0.005, h = dt / finer;
  for (int k = 0; k < 1000; ++k) {
    text += std::to_string(dt * k) + "," + std::to_string(1000 * q + 0.02 * normal(random)) + "\n";
    for (int i = 0; i < finer; ++i) {
      v += h / 2 * (-1970 * q - 30 * std::abs(v) * v) / 2;
      q += h * v;
      v += h / 2 * (-1970 * q - 30 * std::abs(v) * v) / 2;
    }
  }
  return directory.file("run.csv", text);
}

TEST(Laws, GoFromTheirFileThroughTheFitToTheSimulation) {
  const TemporaryDirectory directory;
  const std::string rig = directory.file("rig.toml", "unrig_rig = 1\nname = \"spring\"\n[[modal]]\nmass = \"2 kg\"\nfrequency = \"5 Hz\"\ndamping_ratio = 0.002\ngauge_gain = \"1000 N/m\"\n");
  const std::string run = decay(directory), file = directory.file("law.toml", law), fit = directory.path("fit.json"), out = directory.path("out.csv");
  const Finished fitted = run_unrig(directory, {"fit", "--rig", rig, "--law", file, run, "-o", fit});
  ASSERT_EQ(fitted.status, 0) << fitted.err;
  EXPECT_THAT(fitted.out, HasSubstr("law:drag.c:"));
  const json result = json::parse(read_text(fit));
  EXPECT_EQ(result["effects"][0], "law:drag");
  EXPECT_EQ(result["laws"][0]["text"], law);
  for (const json& p : result["parameters"])
    if (p["name"] == "law:drag.c") {
      EXPECT_NEAR(p["value"].get<double>(), 30, 4 * p["std_error"].get<double>());
      EXPECT_LT(p["std_error"], 1);
      EXPECT_EQ(p["unit"], "N.s^2/m^2");
    }

  std::filesystem::remove(file);
  const std::vector<std::string> simulate{"simulate", "--rig", rig, "--run", run, "--fit", fit, "--release-load", "40 N", "-o", out};
  const auto with = [&](std::vector<std::string> more) {
    std::vector<std::string> all = simulate;
    all.insert(all.end(), more.begin(), more.end());
    return run_unrig(directory, all);
  };
  const Finished simulated = with({});
  EXPECT_EQ(simulated.status, 0) << simulated.err;
  EXPECT_THAT(read_text(out), AllOf(HasSubstr("law:drag: F = -c * abs(v) * v"), HasSubstr("law:drag.c = ")));

  const Finished reported = run_unrig(directory, {"report", fit, "-o", directory.path("report.html")});
  EXPECT_EQ(reported.status, 0) << reported.err;
  EXPECT_THAT(read_text(directory.path("report.html")), AllOf(HasSubstr("law:drag"), HasSubstr("Laws learnt on")));

  std::string changed = law;
  changed.replace(changed.find("abs(v) * v"), 10, "v^3");
  const Finished other = with({"--law", directory.file("other.toml", changed)});
  EXPECT_EQ(other.status, 2);
  EXPECT_THAT(other.err, AllOf(HasSubstr("other.toml: the law \"drag\" is another than the one of this name"), HasSubstr("F = -c * abs(v) * v")));
  changed.replace(changed.find("drag"), 4, "more");
  const Finished more = with({"--law", directory.file("other.toml", changed)});
  EXPECT_EQ(more.status, 0) << more.err;
  EXPECT_THAT(more.err, HasSubstr("the law \"more\" had no part in"));
}

/// The record goes to 0.6 m/s; a release from ten times its load goes further, and so does any run where the law's file says that little was learnt.
TEST(Laws, AreRefusedBeyondWhereTheyWereLearnt) {
  const TemporaryDirectory directory;
  const std::string rig = directory.file("rig.toml", "unrig_rig = 1\nname = \"spring\"\n[[modal]]\nmass = \"2 kg\"\nfrequency = \"5 Hz\"\ndamping_ratio = 0.002\ngauge_gain = \"1000 N/m\"\n");
  const std::string run = decay(directory), fit = directory.path("fit.json"), out = directory.path("out.csv");
  ASSERT_EQ(run_unrig(directory, {"fit", "--rig", rig, "--law", directory.file("law.toml", law), run, "-o", fit}).status, 0);
  const json learnt = json::parse(read_text(fit))["laws"][0]["learnt_on"]["v"];
  EXPECT_THAT(learnt[1].get<double>(), AllOf(Gt(0.3), Lt(0.628))) << "0.02 m times 31.4 rad/s, less what drag takes";
  const auto simulate = [&](const std::string& load, std::vector<std::string> more) {
    std::vector<std::string> words{"simulate", "--rig", rig, "--run", run, "--release-load", load, "-o", out};
    words.insert(words.end(), more.begin(), more.end());
    return run_unrig(directory, words);
  };
  const Finished within = simulate("39 N", {"--fit", fit});
  EXPECT_EQ(within.status, 0) << within.err;
  EXPECT_THAT(within.err, Not(HasSubstr("learnt")));
  std::filesystem::remove(out);

  const Finished beyond = simulate("390 N", {"--fit", fit});
  EXPECT_EQ(beyond.status, 1);
  EXPECT_THAT(beyond.err, AllOf(HasSubstr("run.csv: the law \"drag\" was learnt where v is from -0."), HasSubstr("here v is from -"), HasSubstr("beyond for the first time at 0.0"), HasSubstr("--beyond")));
  EXPECT_FALSE(std::filesystem::exists(out));
  const Finished all_the_same = simulate("390 N", {"--fit", fit, "--beyond"});
  EXPECT_EQ(all_the_same.status, 0) << all_the_same.err;
  EXPECT_THAT(all_the_same.err, HasSubstr("Beyond, a law is a guess"));
  EXPECT_THAT(read_text(out), HasSubstr("a guess: the law \"drag\" was learnt where v"));

  const std::string file = directory.file("timid.toml", law + "[learnt_on]\nv = [\"-1 cm/s\", \"1 cm/s\"]\n");
  const Finished from_file = simulate("39 N", {"--law", file});
  EXPECT_EQ(from_file.status, 1);
  EXPECT_THAT(from_file.err, HasSubstr("was learnt where v is from -0.01 to 0.01 m/s"));
  const Finished fitted = simulate("39 N", {"--law", file, "--fit", fit});
  EXPECT_EQ(fitted.status, 0) << "the fit has learnt more since: " << fitted.err;
}

TEST(Laws, ThatCannotBeReadAreRefusedWithTheirPlace) {
  const TemporaryDirectory directory;
  const std::string rig = directory.file("rig.toml", "unrig_rig = 1\nname = \"spring\"\n[[modal]]\nmass = \"2 kg\"\nfrequency = \"5 Hz\"\ndamping_ratio = 0.002\ngauge_gain = \"1000 N/m\"\n");
  const std::string run = decay(directory);
  std::string wrong = law;
  wrong.replace(wrong.find("abs(v) * v"), 10, "abs(w) * v");
  const std::string file = directory.file("law.toml", wrong), good = directory.file("good.toml", law);
  const Finished unknown = run_unrig(directory, {"fit", "--rig", rig, "--law", file, run, "-o", directory.path("fit.json")});
  EXPECT_EQ(unknown.status, 2);
  EXPECT_THAT(unknown.err, AllOf(HasSubstr("law.toml:4: force: \"w\" is no symbol"), HasSubstr("\n    -c * abs(w) * v\n             ^")));
  EXPECT_FALSE(std::filesystem::exists(directory.path("fit.json")));
  const Finished twice = run_unrig(directory, {"fit", "--rig", rig, "--law", good, "--law", good, run, "-o", directory.path("fit.json")});
  EXPECT_EQ(twice.status, 2);
  EXPECT_THAT(twice.err, HasSubstr("Laws are told apart by their names"));
  const Finished over = run_unrig(directory, {"fit", "--rig", rig, "--law", good, run, "-o", good});
  EXPECT_EQ(over.status, 2);
  EXPECT_EQ(read_text(good), law) << "an input is not written over";
}

}  // namespace
}  // namespace unrig
