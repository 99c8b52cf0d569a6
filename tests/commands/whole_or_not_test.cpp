// Output files are written whole or not at all; very short and very long recordings neither crash nor hang.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdio>
#include <filesystem>
#include <sstream>

#include "core/files/text_file.h"
#include "tests/commands/run_unrig.h"
#include "tests/support/sample_data.h"

namespace unrig {
namespace {

using test::Finished;
using test::null_campaign;
using test::run_unrig;
using test::TemporaryDirectory;
using test::unrig_binary;
using ::testing::HasSubstr;

/// `unrig simulate` of a step with this output, under shell settings such as limits, by a program such as setpriv. Returns the shell's exit status.
int simulate(const std::string& settings, const std::string& output, const TemporaryDirectory& directory, const std::string& by = "") {
  const std::string command = settings + " exec " + by + unrig_binary() + " simulate --rig " + null_campaign("rig.toml") + " --run " + null_campaign("step_a.csv") + " -o " + output + " >/dev/null 2>" + directory.path("err");
  const int status = std::system(("sh -c \"" + command + "\"").c_str());
  return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

std::size_t files_in(const std::string& folder) { return static_cast<std::size_t>(std::distance(std::filesystem::directory_iterator(folder), std::filesystem::directory_iterator{})); }

TEST(WholeOrNot, AFullDiskLeavesTheOldFile) {
  const TemporaryDirectory directory;
  std::filesystem::create_directory(directory.path("out"));
  const std::string output = directory.file("out/run.csv", "the old one");
  // A limit on the size of files is the disk that is full after four blocks; with the signal ignored, write() fails as it does then.
  EXPECT_EQ(simulate("trap '' XFSZ; ulimit -f 4;", output, directory), 2);
  EXPECT_THAT(read_text(directory.path("err")), HasSubstr("cannot be written"));
  EXPECT_EQ(read_text(output), "the old one");
  EXPECT_EQ(files_in(directory.path("out")), 1u);
  EXPECT_EQ(simulate("", "/dev/full", directory), 2);
  EXPECT_THAT(read_text(directory.path("err")), HasSubstr("No space left"));
}

TEST(WholeOrNot, AKilledProcessLeavesTheOldFileAndNothingElse) {
  const TemporaryDirectory directory;
  std::filesystem::create_directory(directory.path("out"));
  const std::string output = directory.file("out/run.csv", "the old one");
  EXPECT_NE(simulate("ulimit -f 4;", output, directory), 0);  // the signal ends it in the middle of the write
  EXPECT_EQ(read_text(output), "the old one");
  // Where the file system knows files without a name; elsewhere a `.unrig-*.tmp` stays.
  const int unnamed = ::open(directory.path("out").c_str(), O_WRONLY | O_TMPFILE, 0600);
  if (unnamed < 0) GTEST_SKIP() << "this file system knows no files without a name";
  ::close(unnamed);
  EXPECT_EQ(files_in(directory.path("out")), 1u);
}

TEST(WholeOrNot, AFolderThatCannotBeWrittenIsAnError) {
  const TemporaryDirectory directory;
  const std::string file = directory.file("file", "no folder");
  for (const std::string& output : std::vector<std::string>{file + "/run.csv", directory.path("absent/run.csv"), directory.path("")}) {
    EXPECT_EQ(simulate("", output, directory), 2) << output;
    EXPECT_THAT(read_text(directory.path("err")), HasSubstr("cannot be written")) << output;
  }
}

TEST(WholeOrNot, AReadOnlyFolderIsAnErrorAndKeepsTheOldFile) {
  namespace fs = std::filesystem;
  // Permission bits do not bind root.
  const std::string by = ::geteuid() == 0 ? "setpriv --reuid=65534 --regid=65534 --clear-groups " : "";
  if (std::system((by + "test -x " + unrig_binary() + " -a -r " + null_campaign("rig.toml") + " 2>/dev/null").c_str()) != 0)
    GTEST_SKIP() << "root can take on no other user here who may read the build and the sample data";
  const TemporaryDirectory directory;
  fs::create_directory(directory.path("out"));
  const std::string old = directory.file("out/run.csv", "the old one");
  fs::permissions(old, fs::perms(0666));  // even a file that may be written cannot be replaced
  fs::permissions(directory.path("out"), fs::perms(0555));
  for (const std::string& output : {old, directory.path("out/new.csv")}) {
    EXPECT_EQ(simulate("", output, directory, by), 2) << output;
    EXPECT_THAT(read_text(directory.path("err")), HasSubstr(output + ": the file cannot be written: Permission denied"));
  }
  EXPECT_EQ(read_text(old), "the old one");
  EXPECT_EQ(files_in(directory.path("out")), 1u);
  fs::permissions(directory.path("out"), fs::perms(0755));  // so that it can be removed
}

/// A step run of that many samples.
std::string step_run(std::size_t samples) {
  std::string text = "# unrig_run = 1\n# kind = \"step\"\n# density = \"998.2 kg/m^3\"\n# speed = \"0.6 m/s\"\ntime [s],alpha [deg],gauge [N]\n";
  char row[64];
  for (std::size_t k = 0; k < samples; ++k) {
    std::snprintf(row, sizeof row, "%.3f,%d,%.1f\n", 0.002 * static_cast<double>(k), k < 500 ? 2 : 4, k < 500 ? 6.0 : 12.0);
    text += row;
  }
  return text;
}

TEST(Lengths, ThreeSamplesGetAnAnswerOrAReason) {
  const TemporaryDirectory directory;
  const std::string run = directory.file("run.csv", step_run(3)), rig = null_campaign("rig.toml");
  EXPECT_EQ(run_unrig(directory, {"simulate", "--rig", rig, "--run", run, "-o", directory.path("out.csv")}).status, 0);
  const Finished fitted = run_unrig(directory, {"fit", "--rig", rig, run, "-o", directory.path("fit.json")});
  EXPECT_GE(fitted.status, 0);
  EXPECT_THAT(fitted.err, ::testing::Not(HasSubstr("internal error")));
}

TEST(Lengths, NothingIsDiagnosedFromNothing) {
  const TemporaryDirectory directory;
  const auto first_of = [&](const char* run, int samples) {
    std::istringstream lines(read_text(null_campaign(run)));
    std::string text;
    int rows = -1;  // the header
    for (std::string line; rows < samples && std::getline(lines, line);) {
      text += line + "\n";
      rows += line.starts_with("#") ? 0 : 1;
    }
    return directory.file(run, text);
  };
  const auto diagnosed = [&](int samples) {
    return run_unrig(directory, {"diagnose", "--rig", null_campaign("rig.toml"), first_of("step_a.csv", samples), first_of("wet_pluck.csv", samples), "-o", directory.path("diagnosis.json")});
  };
  for (const int samples : {3, 4, 8}) {
    const Finished finished = diagnosed(samples);
    EXPECT_EQ(finished.status, 2) << samples;
    EXPECT_THAT(finished.err, HasSubstr("13 unknowns of the run itself"));
  }
  const Finished finished = diagnosed(15);
  EXPECT_EQ(finished.status, 1);
  EXPECT_THAT(finished.err, HasSubstr("too few to tell noise from signal"));
  EXPECT_FALSE(std::filesystem::exists(directory.path("diagnosis.json")));
}

TEST(Lengths, AMillionSamplesFitIntoASixthOfAGigabyte) {
  const TemporaryDirectory directory;
  const std::string run = directory.file("run.csv", step_run(1'000'000)), out = directory.path("out.csv");
  const Finished finished = run_unrig(directory, {"simulate", "--rig", null_campaign("rig.toml"), "--run", run, "-o", out});
  ASSERT_EQ(finished.status, 0) << finished.err;
  EXPECT_GT(std::filesystem::file_size(out), 20'000'000u);
#ifdef NDEBUG  // the sanitizers need memory of their own
  // 15 MB of text read, five columns of a million doubles, and copies of them: 127 MB measured. The 46 MB of text written are not among them.
  EXPECT_LT(finished.peak_memory, 160 * 1024);
#endif
}

}  // namespace
}  // namespace unrig
