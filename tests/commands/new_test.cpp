// `unrig new`: every template is read by the commands that it is for, asks its questions, and never overwrites a file unasked.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <sstream>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "core/files/questions.h"
#include "core/files/text_file.h"
#include "core/new/rig_templates.h"
#include "tests/commands/run_unrig.h"

namespace unrig {
namespace {

using test::Finished;
using test::run_unrig;
using test::TemporaryDirectory;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

std::string written(const TemporaryDirectory& directory, const std::string& name, std::vector<std::string> words) {
  const std::string path = directory.path(name);
  words.insert(words.begin(), "new");
  words.insert(words.end(), {"-o", path});
  const Finished finished = run_unrig(directory, words);
  EXPECT_EQ(finished.status, 0) << finished.err;
  EXPECT_THAT(finished.err, IsEmpty());
  EXPECT_THAT(finished.out, HasSubstr(" questions to you"));
  return path;
}

TEST(New, EveryRigReadsAsItStandsAndAnswersToItsRuns) {
  for (const RigTemplate& one : rig_templates()) {
    const TemporaryDirectory directory;
    const std::string rig = written(directory, "rig.toml", {"rig", "--from", one.name});
    EXPECT_GE(questions_in(read_text(rig)), 2) << one.name;
    std::vector<std::string> check{"check", "--rig", rig};
    for (const std::string kind : {"step", "pluck", "forced", "moved"}) {
      if (one.modal && kind == "step") continue;
      const std::string run = written(directory, kind + ".csv", {"run", "--rig", rig, "--kind", kind});
      EXPECT_GE(questions_in(read_text(run)), 4) << kind;
      const std::vector<std::string> released = kind == "pluck" ? std::vector<std::string>{"--release-load", "20 N"} : std::vector<std::string>{};
      std::vector<std::string> simulate{"simulate", "--rig", rig, "--run", run, "-o", directory.path("simulated.csv")};
      simulate.insert(simulate.end(), released.begin(), released.end());
      const Finished simulated = run_unrig(directory, simulate);
      EXPECT_EQ(simulated.status, 0) << one.name << ' ' << kind << '\n' << simulated.err;
      EXPECT_THAT(simulated.out, HasSubstr("resonance")) << one.name << ' ' << kind;
      check.push_back(run);
    }
    const Finished alone = run_unrig(directory, {"check", "--rig", rig});
    EXPECT_EQ(alone.status, 0) << one.name << '\n' << alone.err;
    EXPECT_THAT(alone.err, IsEmpty()) << one.name;
    const Finished checked = run_unrig(directory, check);
    EXPECT_EQ(checked.status, 0) << one.name << '\n' << checked.err;
    EXPECT_THAT(checked.err, Not(HasSubstr("check:"))) << one.name;
  }
}

TEST(New, ARunNeedsNoRigFile) {
  const TemporaryDirectory directory;
  const std::string tube = written(directory, "tube.toml", {"rig", "--from", "tube"}), modal = written(directory, "modal.toml", {"rig", "--from", "impact-test"});
  const std::string step = written(directory, "step.csv", {"run"}), pluck = written(directory, "pluck.csv", {"run", "--kind", "pluck"});
  EXPECT_EQ(read_text(step), read_text(written(directory, "same.csv", {"run", "--rig", tube, "--kind", "step"}))) << "the template of the tube";
  const std::string forced = written(directory, "forced.csv", {"run", "--kind", "forced"}), moved = written(directory, "moved.csv", {"run", "--kind", "moved"});
  EXPECT_EQ(run_unrig(directory, {"check", "--rig", tube, step, pluck}).status, 0);
  EXPECT_EQ(run_unrig(directory, {"check", "--rig", modal, forced, moved}).status, 0);
}

TEST(New, TheTemplatesOfATubeCanBeFitted) {
  const TemporaryDirectory directory;
  const std::string rig = written(directory, "rig.toml", {"rig", "--from", "tube"}), step = written(directory, "step.csv", {"run"}), pluck = written(directory, "pluck.csv", {"run", "--kind", "pluck"});
  const std::string fit = directory.path("fit.json");
  const Finished fitted = run_unrig(directory, {"fit", "--rig", rig, step, pluck, "-o", fit});
  ASSERT_EQ(fitted.status, 0) << fitted.err;
  int looked_at = 0;
  const nlohmann::json result = nlohmann::json::parse(read_text(fit));
  for (const auto& parameter : result.at("parameters")) {
    const std::string name = parameter.at("name");
    if (name.ends_with("stiffness_scale")) {
      EXPECT_NEAR(parameter.at("value").get<double>(), 1, 5 * parameter.at("std_error").get<double>()) << name;
      ++looked_at;
    }
  }
  EXPECT_EQ(looked_at, 2);
}

TEST(New, WithoutOutputItGoesToStandardOutput) {
  const TemporaryDirectory directory;
  const Finished printed = run_unrig(directory, {"new", "rig", "--from", "modes"});
  EXPECT_EQ(printed.status, 0);
  EXPECT_EQ(printed.out, rig_template("modes").text);
}

TEST(New, NeverOverwritesUnasked) {
  const TemporaryDirectory directory;
  const std::string mine = directory.file("rig.toml", "mine");
  const Finished refused = run_unrig(directory, {"new", "rig", "--from", "tube", "-o", mine});
  EXPECT_EQ(refused.status, 2);
  EXPECT_THAT(refused.err, HasSubstr("the file exists; wanted a new name. --force writes over it."));
  EXPECT_EQ(read_text(mine), "mine");
  EXPECT_EQ(run_unrig(directory, {"new", "rig", "--from", "tube", "-o", mine, "--force"}).status, 0);
  EXPECT_EQ(read_text(mine), rig_template("tube").text);
  const Finished itself = run_unrig(directory, {"new", "run", "--rig", mine, "-o", mine, "--force"});
  EXPECT_EQ(itself.status, 2);
  EXPECT_THAT(itself.err, HasSubstr("would overwrite the input"));
}

TEST(New, WrongUseIsNamed) {
  const TemporaryDirectory directory;
  const std::string modal = written(directory, "modal.toml", {"rig", "--from", "modes"});
  const struct {
    std::vector<std::string> words;
    const char* says;
  } wrong[] = {{{"new"}, "what is required"},
               {{"new", "rigg"}, "\"rigg\" is neither rig nor run"},
               {{"new", "rig"}, "--from is missing; wanted what is known of the rig: tube, plate, drawing, modes, impact-test"},
               {{"new", "rig", "--from", "tub"}, "there is no template \"tub\"; wanted one of: tube, plate, drawing, modes, impact-test. Did you mean tube?"},
               {{"new", "rig", "--from", "tube", "--kind", "step"}, "--kind; wanted it only for a run"},
               {{"new", "run", "--from", "tube"}, "--from; wanted it only for a rig"},
               {{"new", "run", "--kind", "stpe"}, "Did you mean step?"},
               {{"new", "run", "--rig", modal, "--kind", "step"}, "the rig is known only as modes"}};
  for (const auto& [words, says] : wrong) {
    const Finished finished = run_unrig(directory, words);
    EXPECT_EQ(finished.status, 2) << says;
    EXPECT_THAT(finished.err, HasSubstr(says));
    EXPECT_THAT(finished.out, IsEmpty());
  }
}

}  // namespace
}  // namespace unrig
