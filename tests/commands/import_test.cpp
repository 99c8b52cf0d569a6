// `unrig import` as it is called, on files that other programs wrote: SciPy's savemat and MATLAB's layouts of it, and text.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>

#include "core/run/run.h"
#include "core/files/text_file.h"
#include "tests/commands/run_unrig.h"
#include "tests/support/sample_data.h"

namespace unrig {
namespace {

using test::Finished;
using test::run_unrig;
using test::TemporaryDirectory;
using ::testing::ContainsRegex;
using ::testing::HasSubstr;

const std::string map = "unrig_import = 1\n[run]\nkind = \"step\"\ndensity = \"998 kg/m^3\"\nspeed = \"0.6 m/s\"\n[time]\nrate = \"500 Hz\"\n[[column]]\nname = \"gauge\"\nsource = \"";

TEST(ImportCommand, ReadsWhatSciPyWrote) {
  if (std::system("/usr/bin/python3 -c 'import scipy.io' 2>/dev/null") != 0) GTEST_SKIP() << "no SciPy on this machine; sample_data/setup.sh --optional installs it";
  const TemporaryDirectory directory;
  const std::string script = "import sys, numpy, scipy.io\n"
                             "x = numpy.sin(numpy.arange(1000) / 7)\n"
                             "for name, packed in (('plain', False), ('packed', True)):\n"
                             "  scipy.io.savemat(sys.argv[1] + name + '.mat', {'x': x, 'data': {'load': x.astype('f4'), 'n': numpy.arange(1000, dtype='i2')}}, do_compression=packed)\n";
  ASSERT_EQ(std::system(("/usr/bin/python3 " + directory.file("write.py", script) + " " + directory.path("")).c_str()), 0);
  for (const std::string name : {"plain.mat", "packed.mat"})
    for (const std::string source : {"x", "data.load"}) {
      const Finished finished = run_unrig(directory, {"import", directory.path(name), "--map", directory.file("map.toml", map + source + "\"\nunit = \"N\"\n"), "-o", directory.path("run.csv")});
      ASSERT_EQ(finished.status, 0) << finished.err;
      const unrig::Run run = read_run(directory.path("run.csv"));
      ASSERT_EQ(run.samples(), 1000);
      for (Eigen::Index k = 0; k < 1000; ++k) EXPECT_NEAR(run.channel("gauge").value[k], std::sin(static_cast<double>(k) / 7), source == "x" ? 1e-12 : 6e-8);  // digits written; single precision
    }
  const Finished listed = run_unrig(directory, {"import", directory.path("packed.mat"), "--list"});
  EXPECT_THAT(listed.out, HasSubstr("data.n"));
  EXPECT_THAT(listed.out, HasSubstr("UNSCALED"));
}

TEST(ImportCommand, ReadsWhatOctaveWroteForMatlabAndNamesItsOwnFormats) {
  if (std::system("octave-cli --version >/dev/null 2>&1") != 0) GTEST_SKIP() << "no GNU Octave on this machine (Debian: octave)";
  const TemporaryDirectory directory;
  const std::string script = "x = sin((0:999)' / 7); n = 0:999; data.load = single(x); data.part(2).n = int16(n); text = 'abc'; z = x + i; flags = x > 0;\n"
                             "for kind = {'v7', 'v6', 'hdf5', 'binary', 'text'}\n  save(['-' kind{1}], [kind{1} '.mat'], 'x', 'n', 'data', 'text', 'z', 'flags')\nend\n";
  ASSERT_EQ(std::system(("cd " + directory.path("") + " && octave-cli --quiet --no-init-file " + directory.file("write.m", script) + " 2>" + directory.path("octave")).c_str()), 0) << read_text(directory.path("octave"));
  for (const std::string name : {"v7.mat", "v6.mat"}) {
    for (const std::string source : {"x", "data.load", "n"}) {
      const Finished finished = run_unrig(directory, {"import", directory.path(name), "--map", directory.file("map.toml", map + source + "\"\nunit = \"N\"\n"), "-o", directory.path("run.csv")});
      ASSERT_EQ(finished.status, 0) << finished.err;
      const unrig::Run run = read_run(directory.path("run.csv"));
      ASSERT_EQ(run.samples(), 1000);
      for (Eigen::Index k = 0; k < 1000; ++k)
        EXPECT_NEAR(run.channel("gauge").value[k], source == "n" ? static_cast<double>(k) : std::sin(static_cast<double>(k) / 7), source == "x" ? 1e-12 : 6e-8);  // digits written; single precision
    }
    const Finished listed = run_unrig(directory, {"import", directory.path(name), "--list"});
    EXPECT_THAT(listed.out, ContainsRegex("data.part\\(2\\).n +1000 .*UNSCALED"));
    EXPECT_THAT(listed.err, HasSubstr("z is left out: its numbers are complex"));
    EXPECT_THAT(listed.err, HasSubstr("text is left out: it holds no numbers"));
  }
  for (const std::string name : {"hdf5.mat", "binary.mat", "text.mat"}) {
    const Finished finished = run_unrig(directory, {"import", directory.path(name), "--list"});
    EXPECT_EQ(finished.status, 2) << name;
    EXPECT_THAT(finished.err, HasSubstr("Octave")) << name;
    EXPECT_THAT(finished.err, HasSubstr("`save -v7 FILE`")) << name;
  }
}

TEST(ImportCommand, SurvivesAFileAtWhichHdf5BreaksDown) {
  const TemporaryDirectory directory;
  const Finished finished = run_unrig(directory, {"import", test::source_path("tests/fuzz/corpus/mat73/ends_hdf5.mat"), "--list"});
  ASSERT_NE(finished.status, -1) << "it ended by a signal";
  if (finished.status != 0) {  // another HDF5 than Debian 12's may get on with it
    EXPECT_EQ(finished.status, 2);
    EXPECT_THAT(finished.err, HasSubstr("HDF5, which reads it, broke down"));
  }
}

/// Found by tests/fuzz/mutate.py: the 40 samples of its gauge claim to be more than any memory holds.
TEST(ImportCommand, LeavesOutWhatAsksForAllMemory) {
  const TemporaryDirectory directory;
  const Finished finished = run_unrig(directory, {"import", test::source_path("tests/fuzz/corpus/mat73/asks_for_all_memory.mat"), "--list"});
  EXPECT_LT(finished.peak_memory, 8'000'000) << "KB; 1.1e6 measured, under the sanitizers 3.8e6, without a limit 23e6";
  if (finished.status != 0) {  // under the sanitizers the child's time is over first
    EXPECT_EQ(finished.status, 2);
    EXPECT_THAT(finished.err, HasSubstr("HDF5, which reads it, broke down"));
  } else {
    EXPECT_THAT(finished.err, HasSubstr("the variable gauge is left out"));
    EXPECT_THAT(finished.out, AllOf(HasSubstr("time"), Not(HasSubstr("gauge"))));
  }
}

TEST(ImportCommand, LeavesOutTextAndNamesItWhereItIsMapped) {
  const TemporaryDirectory directory;
  std::string text = "Stamp;Clock;F;Status;G\n";
  for (int k = 0; k < 20; ++k) text += "23.11.2026 12:00:00,0" + std::to_string(10 + k) + ";12:00:00,0" + std::to_string(10 + k) + ";" + (k == 5 ? "ERR" : "0," + std::to_string(k)) + ";OK;1\n";
  const std::string file = directory.file("log.csv", text);
  const auto import_with = [&](const std::string& mapping) { return run_unrig(directory, {"import", file, "--map", directory.file("map.toml", mapping), "-o", directory.path("run.csv")}); };
  const std::string force = "F\"\nunit = \"N\"\n";

  const Finished listed = run_unrig(directory, {"import", file, "--list"});
  EXPECT_THAT(listed.out, HasSubstr("the decimal sign is the comma, 2 channels"));
  EXPECT_THAT(listed.out, HasSubstr("since 12:00:00,010"));
  EXPECT_THAT(listed.out, HasSubstr("1000 Hz"));
  EXPECT_EQ(run_unrig(directory, {"import", file}).out, listed.out) << "without anything else, too";
  EXPECT_THAT(listed.out, HasSubstr("left out: \"OK\" is no number (line 2)"));

  const Finished unmarked = import_with(map + force);
  EXPECT_EQ(unmarked.status, 2);
  EXPECT_THAT(unmarked.err, HasSubstr("log.csv:7: \"ERR\" is no number, in the column \"F\"; wanted numbers only, as " + directory.path("map.toml") + ":10 makes it a column of the run. "));
  EXPECT_THAT(unmarked.err, HasSubstr("missing = [\"ERR\"]"));
  EXPECT_FALSE(std::filesystem::exists(directory.path("run.csv")));

  const std::string marked = map + force + "[format]\nmissing = [\"ERR\"]\n";
  const Finished with_rate = import_with(marked);
  ASSERT_EQ(with_rate.status, 0) << with_rate.err;
  EXPECT_THAT(with_rate.out, HasSubstr("20 samples from " + file + " (text; by its numbers the decimal sign is the comma)"));
  EXPECT_THAT(with_rate.out, HasSubstr("gauge [N] from F, 1 missing"));
  EXPECT_THAT(with_rate.err, HasSubstr("log.csv:2: the column \"Stamp\" is left out: \"23.11.2026 12:00:00,010\" is no number and no time stamp"));
  EXPECT_EQ(read_run(directory.path("run.csv")).channel("gauge").missing, 1u);

  const auto timed_by = [&](const std::string& source) {
    std::string mapping = marked;
    return import_with(mapping.replace(mapping.find("rate = \"500 Hz\""), 15, "source = \"" + source + "\""));
  };
  ASSERT_EQ(timed_by("Clock").status, 0) << timed_by("Clock").err;
  EXPECT_NEAR(read_run(directory.path("run.csv")).dt, 0.001, 1e-15);
  EXPECT_EQ(timed_by("Stamp").status, 2);
  EXPECT_THAT(timed_by("Stamp").err, HasSubstr("rate = \"500 Hz\""));

  const Finished wrong = import_with(map + force + "[format]\nmissing = \"ERR\"\n");
  EXPECT_EQ(wrong.status, 2);
  EXPECT_THAT(wrong.err, HasSubstr("wanted a list of texts"));
  for (const std::string format : {"thousands = \";\"", "thousands = \",\"\ndecimal = \",\"", "skip_lines = -1", "decimal = \"\""})
    EXPECT_EQ(import_with(map + force + "[format]\n" + format + "\n").status, 2) << format;
}

TEST(ImportCommand, RefusesAndLeavesNothingBehind) {
  const TemporaryDirectory directory;
  const std::string mapping = directory.file("map.toml", map + "F\"\nunit = \"N\"\n");
  const std::vector<std::pair<std::string, std::string>> bad{{directory.file("text.txt", "F\n1\nx\n2\n"), "\"x\""},
                                                             {directory.file("other.txt", "G\n1\n2\n3\n"), "no channel \"F\""},
                                                             {directory.file("short.txt", "F\n1\n2\n"), "rows"},
                                                             {directory.file("twice.txt", "F,F\n1,2\n2,3\n3,4\n"), "more than one channel \"F\""},
                                                             {directory.file("book.xlsx", "PK\x03\x04"), "Export the sheet as CSV"},
                                                             {directory.file("binary.bin", std::string("\x7f\0\1\2", 4)), "binary"},
                                                             {directory.file("cut.tdms", "TDSm"), "TDMS"},
                                                             {directory.file("cut.mat", "MATLAB 5.0"), "MATLAB"},
                                                             {directory.file("cut.uff", "    -1\n    58\nname\n"), "cut.uff:3"}};
  for (const auto& [file, complaint] : bad) {
    const Finished finished = run_unrig(directory, {"import", file, "--map", mapping, "-o", directory.path("run.csv")});
    EXPECT_EQ(finished.status, 2) << file;
    EXPECT_THAT(finished.err, HasSubstr(complaint)) << file;
    EXPECT_FALSE(std::filesystem::exists(directory.path("run.csv"))) << file;
  }
  EXPECT_EQ(run_unrig(directory, {"import", bad[0].first}).status, 2);
}

}  // namespace
}  // namespace unrig
