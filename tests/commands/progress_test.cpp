// Progress: on a terminal one line that comes and goes, nothing in pipes. `script` lends the terminal.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <sys/wait.h>

#include <cstdlib>

#include "core/files/text_file.h"
#include "tests/commands/run_unrig.h"
#include "tests/support/sample_data.h"

namespace unrig {
namespace {

using test::null_campaign;
using test::TemporaryDirectory;
using test::unrig_binary;
using ::testing::HasSubstr;
using ::testing::Not;

TEST(Progress, IsSeenOnATerminalAndGoneAtTheEnd) {
  if (std::system("command -v script >/dev/null 2>&1") != 0) GTEST_SKIP() << "no `script` on this machine (Debian: bsdutils)";
  const TemporaryDirectory directory;
  const std::string rig = null_campaign("rig.toml"), step = null_campaign("step_a.csv"), fit = directory.path("fit.json"), corrected = directory.path("corrected.csv");
  const std::string erase = "\r\033[K";
  const auto on_a_terminal = [&](const std::string& arguments) {
    const std::string seen = directory.path("seen");
    EXPECT_EQ(std::system(("script -qec '" + unrig_binary() + " " + arguments + "' /dev/null >" + seen + " 2>&1 </dev/null").c_str()), 0) << read_text(seen);
    return read_text(seen);
  };
  const std::vector<std::string> commands{"fit --rig " + rig + " " + null_campaign("dry_pluck.csv") + " " + step + " -o " + fit,
                                          "correct --rig " + rig + " --fit " + fit + " " + step + " -o " + corrected,
                                          "simulate --rig " + rig + " --run " + step + " -o " + directory.path("simulated.csv"),
                                          "report " + fit + " " + corrected + " -o " + directory.path("report.html")};
  for (const std::string& command : commands) {
    const std::string seen = on_a_terminal(command);
    const std::size_t shown = seen.rfind(" ...");
    ASSERT_NE(shown, std::string::npos) << command << " shows nothing:\n" << seen;
    EXPECT_EQ(seen.substr(shown + 4, erase.size()), erase) << command;
    // Piped, the same command says nothing of it.
    const std::string err = directory.path("err");
    ASSERT_EQ(std::system((unrig_binary() + " " + command + " >/dev/null 2>" + err).c_str()), 0);
    EXPECT_THAT(read_text(err), Not(HasSubstr(" ..."))) << command;
    EXPECT_THAT(read_text(err), Not(HasSubstr("\033"))) << command;
  }
}

/// What a call writes on standard output and standard error.
struct Said {
  int status;
  std::string out, err;
};

Said said(const TemporaryDirectory& directory, const std::string& arguments) {
  const std::string out = directory.path("out"), err = directory.path("err");
  const int status = std::system((unrig_binary() + " " + arguments + " >" + out + " 2>" + err).c_str());
  return {WEXITSTATUS(status), read_text(out), read_text(err)};
}

TEST(Manners, QuietVerboseAndJson) {
  const TemporaryDirectory directory;
  const std::string fit = directory.path("fit.json"), arguments = "fit --rig " + null_campaign("rig.toml") + " " + null_campaign("dry_pluck.csv") + " -o " + fit;
  const Said plain = said(directory, arguments);
  EXPECT_EQ(plain.status, 0);
  EXPECT_THAT(plain.out, HasSubstr("[[Variables]]"));
  EXPECT_THAT(plain.err, testing::AllOf(HasSubstr("warning: "), Not(HasSubstr("progress: "))));

  const Said quiet = said(directory, arguments + " --quiet");
  EXPECT_EQ(quiet.status, 0);
  EXPECT_EQ(quiet.out + quiet.err, "");

  EXPECT_THAT(said(directory, arguments + " --verbose").err, HasSubstr("progress: "));

  const Said json = said(directory, arguments + " --json");
  EXPECT_EQ(json.out, read_text(fit));
  EXPECT_THAT(json.err, HasSubstr("warning: "));

  // Where nothing was written there is nothing to print, an older result least of all.
  const Said refused = said(directory, "fit --rig " + null_campaign("rig.toml") + " " + directory.path("none.csv") + " -o " + fit + " --json");
  EXPECT_EQ(refused.status, 2);
  EXPECT_EQ(refused.out, "");
  const Said columns = said(directory, "correct --json -o " + directory.path("c.csv"));
  EXPECT_EQ(columns.status, 2);
  EXPECT_THAT(columns.err, HasSubstr("FILE.json"));
}

}  // namespace
}  // namespace unrig
