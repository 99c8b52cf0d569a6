// How the binary is called: help, wrong use.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <sstream>
#include <string>
#include <vector>

#include "tests/commands/run_unrig.h"

namespace unrig {
namespace {

using test::Finished;
using test::run_unrig;
using test::TemporaryDirectory;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

/// The commands that `unrig --help` lists: lines indented by two, first word.
std::vector<std::string> listed_commands(const std::string& help) {
  std::vector<std::string> names;
  std::istringstream lines(help);
  for (std::string line; std::getline(lines, line);) {
    if (!line.starts_with("  ") || line.starts_with("   ")) continue;
    std::istringstream words(line);
    words >> names.emplace_back();
  }
  return names;
}

TEST(Help, ListsTheCommands) {
  const TemporaryDirectory directory;
  const Finished help = run_unrig(directory, {"--help"});
  EXPECT_EQ(help.status, 0);
  EXPECT_THAT(help.err, IsEmpty());
  EXPECT_THAT(listed_commands(help.out), ::testing::IsSupersetOf({"simulate", "fit", "apparent-mass", "correct"}));
  EXPECT_EQ(run_unrig(directory, {"-h"}).out, help.out);
}

TEST(Help, OfEveryCommandHasItsOptionsAndAnExample) {
  const TemporaryDirectory directory;
  for (const std::string& command : listed_commands(run_unrig(directory, {"--help"}).out)) {
    const Finished help = run_unrig(directory, {command, "--help"});
    EXPECT_EQ(help.status, 0) << command;
    EXPECT_THAT(help.err, IsEmpty()) << command;
    EXPECT_THAT(help.out, HasSubstr("unrig " + command));
    EXPECT_THAT(help.out, HasSubstr("--output"));
    EXPECT_THAT(help.out, HasSubstr("Example:")) << command;
  }
}

TEST(Help, IsACommandToo) {
  const TemporaryDirectory directory;
  EXPECT_EQ(run_unrig(directory, {"help"}).out, run_unrig(directory, {"--help"}).out);
  const Finished of_fit = run_unrig(directory, {"help", "fit"});
  EXPECT_EQ(of_fit.status, 0);
  EXPECT_EQ(of_fit.out, run_unrig(directory, {"fit", "--help"}).out);
  const Finished unknown = run_unrig(directory, {"help", "fitt"});
  EXPECT_EQ(unknown.status, 2);
  EXPECT_THAT(unknown.err, HasSubstr("no command 'fitt'; did you mean fit?"));
}

TEST(Help, SaysTheVersion) {
  const TemporaryDirectory directory;
  const Finished version = run_unrig(directory, {"--version"});
  EXPECT_EQ(version.status, 0);
  EXPECT_THAT(version.out, ::testing::MatchesRegex("unrig [0-9]+\\.[0-9]+\\.[0-9]+\n"));
  for (const char* short_form : {"-v", "-V"}) EXPECT_EQ(run_unrig(directory, {short_form}).out, version.out);
}

TEST(WrongUse, EndsWithStatusTwoAndSaysWhy) {
  const TemporaryDirectory directory;
  const Finished nothing = run_unrig(directory, {});
  EXPECT_EQ(nothing.status, 2);
  EXPECT_THAT(nothing.out, IsEmpty());
  EXPECT_THAT(nothing.err, HasSubstr("usage: unrig COMMAND"));

  const Finished unknown = run_unrig(directory, {"fti"});
  EXPECT_EQ(unknown.status, 2);
  EXPECT_THAT(unknown.out, IsEmpty());
  EXPECT_THAT(unknown.err, HasSubstr("'fti'; did you mean fit?"));

  struct {
    std::vector<std::string> arguments;
    std::string complaint;
  } const wrong[] = {
      {{"fit"}, "--rig is required"},
      {{"fit", "--rig", "rig.toml", "-o", "fit.json"}, "runs is required"},
      {{"fit", "--rig", "rig.toml", "run.csv"}, "--output is required"},
      {{"fit", "--rig", "rig.toml", "--wanger", "jones", "run.csv", "-o", "fit.json"}, "unrig fit: --wanger is no option of this command; did you mean --wagner?"},
      {{"fit", "--rgi", "rig.toml", "run.csv", "-o", "fit.json"}, "unrig fit: --rgi is no option of this command; did you mean --rig?"},
      {{"fit", "--rig", "rig.toml", "run.csv", "-o", "fit.json", "--verbose=2"}, "unrig fit: --verbose=2 is no option of this command\n"},
      {{"report", "-x", "fit.json", "-o", "report.html"}, "unrig report: -x is no option"},
      {{"diagnose", "--rig", "rig.toml", "--hedlout", "a.csv", "b.csv", "-o", "d.json"}, "did you mean --heldout?"},
      {{"correct", "--rig", "rig.toml", "run.csv", "-o", "out.csv"}, "--fit is required"},
      {{"correct", "--rig", "rig.toml", "--fit", "fit.json", "a.csv", "b.csv", "-o", "out.csv"}, "b.csv"},
      {{"correct", "--rig", "rig.toml", "--fit", "fit.json", "a.csv", "-o", "out.csv", "--at-step", "half"}, "half"},
      {{"apparent-mass", "--rig", "rig.toml", "--dry", "dry.csv", "-o", "out.json"}, "--wet is required"},
      {{"simulate", "--rig", "rig.toml", "-o", "out.csv"}, "--run is required"},
  };
  for (const auto& [arguments, complaint] : wrong) {
    const Finished finished = run_unrig(directory, arguments);
    EXPECT_EQ(finished.status, 2) << complaint;
    EXPECT_THAT(finished.out, IsEmpty()) << complaint;
    EXPECT_THAT(finished.err, HasSubstr(complaint));
  }
}

}  // namespace
}  // namespace unrig
