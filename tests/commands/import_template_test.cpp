// `unrig import`: the mapping that it writes, keys of the head from the command line, many files in one call.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <string>
#include <utility>

#include "core/files/text_file.h"
#include "core/run/run.h"
#include "tests/commands/run_unrig.h"

namespace unrig {
namespace {

using test::Finished;
using test::run_unrig;
using test::TemporaryDirectory;
using ::testing::HasSubstr;

/// What a logger writes of a pitch step: `names` is the first line.
std::string log_of(const std::string& names, double load = 10) {
  std::string text = names + "\n";
  for (int k = 0; k < 300; ++k) {
    const double t = 0.002 * k;
    text += std::to_string(t) + ';' + std::to_string(k < 100 ? 2.0 : 4.0) + ';' + std::to_string(load + std::sin(40 * t)) + ";OK\n";
  }
  return text;
}

TEST(ImportTemplate, ImportsAsItStandsAndAsks) {
  const TemporaryDirectory directory;
  const std::string log = directory.file("logger.csv", log_of("Time (s);Angle (deg);Load cell (N);Status")), map = directory.path("map.toml"), run = directory.path("run.csv");
  const Finished written = run_unrig(directory, {"import", log, "--template", "-o", map});
  ASSERT_EQ(written.status, 0) << written.err;
  EXPECT_THAT(written.out, HasSubstr("questions to you"));
  const std::string text = read_text(map);
  EXPECT_THAT(text, HasSubstr("kind = \"step\""));
  EXPECT_THAT(text, HasSubstr("# 300 samples, 9 to 11 N"));
  EXPECT_THAT(text, HasSubstr("name = \"gauge\"\nsource = \"Load cell\""));
  EXPECT_THAT(text, HasSubstr("# left out: \"Status\": \"OK\""));
  const Finished imported = run_unrig(directory, {"import", log, "--map", map, "-o", run});
  ASSERT_EQ(imported.status, 0) << imported.err;
  const unrig::Run read = read_run(run);
  EXPECT_EQ(read.samples(), 300);
  EXPECT_NEAR(read.dt, 0.002, 1e-12);
  EXPECT_NEAR(read.channel("gauge").value[0], 10, 1e-6);
  EXPECT_NEAR(read.channel("alpha").value[299], 4 * std::acos(-1.0) / 180, 1e-9);
  EXPECT_EQ(run_unrig(directory, {"import", log, "--template"}).out, text) << "without -o to standard output";

  const Finished refused = run_unrig(directory, {"import", log, "--template", "-o", map});
  EXPECT_EQ(refused.status, 2);
  EXPECT_THAT(refused.err, HasSubstr("the file exists"));
  EXPECT_EQ(run_unrig(directory, {"import", log, "--template", "--force", "-o", map}).status, 0);
  EXPECT_EQ(run_unrig(directory, {"import", log, "--template", "--map", map}).status, 2);
}

TEST(ImportTemplate, TakesNothingForNewtonsThatTheFileDoesNotCallSo) {
  const TemporaryDirectory directory;
  const std::string log = directory.file("logger.csv", log_of("t;angle;load;status")), map = directory.path("map.toml"), run = directory.path("run.csv");
  ASSERT_EQ(run_unrig(directory, {"import", log, "--template", "-o", map}).status, 0);
  EXPECT_THAT(read_text(map), HasSubstr("# ? The file gives no unit; which is it?\nunit = \"V\""));
  EXPECT_THAT(read_text(map), HasSubstr("# ? The file gives no time: how many samples a second?"));
  const Finished imported = run_unrig(directory, {"import", log, "--map", map, "-o", run});
  ASSERT_EQ(imported.status, 0) << imported.err;
  EXPECT_THAT(imported.err, HasSubstr("\"gauge\" stays in V: the file gives no calibration"));
}

TEST(ImportTemplate, OfAHammerRecordIsForced) {
  const TemporaryDirectory directory;
  const std::string log = directory.file("logger.csv", log_of("Time (s);Hammer (N);Load cell (N);status"));
  const Finished printed = run_unrig(directory, {"import", log, "--template"});
  EXPECT_THAT(printed.out, HasSubstr("kind = \"forced\""));
  EXPECT_THAT(printed.out, HasSubstr("name = \"force\"\nsource = \"Hammer\""));
  EXPECT_THAT(printed.out, HasSubstr("name = \"gauge\"\nsource = \"Load cell\""));
}

const std::string map = "unrig_import = 1\n[run]\nkind = \"step\"\ndensity = \"1.2 kg/m^3\"\nspeed = \"20 m/s\"\nspeed_std_percent = 2\n"
                        "[time]\nsource = \"Time\"\n[[column]]\nname = \"alpha\"\nsource = \"Angle\"\n[[column]]\nname = \"gauge\"\nsource = \"Load cell\"\n";

TEST(ImportSet, TakesThePlaceOfWhatTheMappingSays) {
  const TemporaryDirectory directory;
  const std::string log = directory.file("logger.csv", log_of("Time (s);Angle (deg);Load cell (N);Status")), run = directory.path("run.csv"), mapping = directory.file("map.toml", map);
  ASSERT_EQ(run_unrig(directory, {"import", log, "--map", mapping, "--set", "speed=108 km/h", "--set", "name=fast one", "--set", "speed_std_percent=0.5", "-o", run}).status, 0);
  const unrig::Run read = read_run(run);
  EXPECT_NEAR(read.speed, 30, 1e-12);
  EXPECT_NEAR(read.density, 1.2, 1e-12);
  EXPECT_EQ(read.name, "fast one");
  EXPECT_THAT(read_text(run), HasSubstr("# speed_std_percent = 0.5\n"));

  const std::string bare = directory.file("bare.toml", "unrig_import = 1\n" + map.substr(map.find("[time]")));
  EXPECT_EQ(run_unrig(directory, {"import", log, "--map", bare, "--set", "kind=step", "--set", "speed=20 m/s", "--set", "density=1.2 kg/m^3", "-o", run}).status, 0) << "the head may come from the command line alone";

  const std::pair<const char*, const char*> wrong[] = {{"sped=20 m/s", "Did you mean speed?"},   {"speed=20", "has no unit"},  {"speed=20 kg", "wanted"},
                                                       {"speed", "gives speed no value"},        {"speed=-1 m/s", "wanted zero or more"},      {"kind=stpe", "wanted step, pluck, forced or moved"},
                                                       {"speed_std_percent=x", "wanted a number"}};
  std::filesystem::remove(run);
  for (const auto& [setting, says] : wrong) {
    const Finished finished = run_unrig(directory, {"import", log, "--map", mapping, "--set", setting, "-o", run});
    EXPECT_EQ(finished.status, 2) << setting;
    EXPECT_THAT(finished.err, HasSubstr("--set: ")) << setting;
    EXPECT_THAT(finished.err, HasSubstr(says)) << setting;
    EXPECT_FALSE(std::filesystem::exists(run)) << setting;
  }
}

TEST(ImportMany, GoIntoAFolderAllOrNone) {
  const TemporaryDirectory directory;
  const std::string names = "Time (s);Angle (deg);Load cell (N);Status", mapping = directory.file("map.toml", map);
  const std::string a = directory.file("a.csv", log_of(names, 10)), b = directory.file("b.csv", log_of(names, 20)), broken = directory.file("c.csv", "Time (s);Angle (deg)\n0;1\n1;2\n");
  const Finished done = run_unrig(directory, {"import", a, b, "--map", mapping, "--set", "speed=30 m/s", "-o", directory.path("runs/")});
  ASSERT_EQ(done.status, 0) << done.err;
  EXPECT_NEAR(read_run(directory.path("runs/a.csv")).channel("gauge").value[0], 10, 1e-6);
  EXPECT_NEAR(read_run(directory.path("runs/b.csv")).channel("gauge").value[0], 20, 1e-6);
  EXPECT_EQ(read_run(directory.path("runs/b.csv")).speed, 30);

  const Finished failed = run_unrig(directory, {"import", a, broken, "--map", mapping, "-o", directory.path("other/")});
  EXPECT_EQ(failed.status, 2);
  EXPECT_FALSE(std::filesystem::exists(directory.path("other/a.csv")));
  EXPECT_EQ(run_unrig(directory, {"import", a, b, "--map", mapping, "-o", directory.path("one.csv")}).status, 2);
  const Finished itself = run_unrig(directory, {"import", a, b, "--map", mapping, "-o", directory.path("")});
  EXPECT_EQ(itself.status, 2) << "the run of a.csv would take its place";
  EXPECT_THAT(itself.err, HasSubstr("would overwrite the input"));
  std::filesystem::create_directory(directory.path("more"));
  const std::string twin = directory.file("more/a.csv", log_of(names, 30));
  EXPECT_THAT(run_unrig(directory, {"import", a, twin, "--map", mapping, "-o", directory.path("runs/")}).err, HasSubstr("wanted files of different names"));
  EXPECT_THAT(run_unrig(directory, {"import", a, b}).out, HasSubstr("b.csv: text")) << "both are listed";
}

}  // namespace
}  // namespace unrig
