#include "core/run/run_text.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <string>

#include "tests/support/temporary_directory.h"

namespace unrig {
namespace {

using std::numbers::pi;
using testing::HasSubstr;

constexpr const char* meta_data =
    "# unrig_run = 1\n# name = \"a \\\"run\\\"\"\n# kind = \"forced\"\n# medium = \"air\"\n# density = \"1.2 kg/m^3\"\n# speed = \"2 "
    "ft/s\"\n";

TEST(RunText, ReadsBackAsTheSameRun) {
  const test::TemporaryDirectory directory;
  const std::string text = std::string(meta_data) +
                           "# calibration = \"4.4 N/V\"\n"
                           "time [s],alpha [deg],gauge [mV],force [lbf],bath [degC],colour [bogus],weight\n"
                           "-0.001,1.25,100,1,20,3,1\n0.000,1.5,nan,2,21,4,0\n0.001,1.75,300,3,22,5,1\n";
  const unrig::Run run = read_run(directory.file("in.csv", text));
  const std::string written = run_text(run, {"a remark"});
  const unrig::Run back = read_run(directory.file("out.csv", written));

  EXPECT_EQ(back.name, "a \"run\"");
  EXPECT_EQ(back.kind, RunKind::forced);
  EXPECT_EQ(back.medium, "air");
  EXPECT_DOUBLE_EQ(back.density, 1.2);
  EXPECT_DOUBLE_EQ(back.speed, 0.6096);
  EXPECT_DOUBLE_EQ(back.start, -0.001);
  EXPECT_NEAR(back.dt, 0.001, 1e-12);
  ASSERT_EQ(back.channels.size(), run.channels.size());
  for (std::size_t c = 0; c < run.channels.size(); ++c) {
    EXPECT_EQ(back.channels[c].name, run.channels[c].name);
    EXPECT_EQ(back.channels[c].unit, run.channels[c].unit);
    for (Eigen::Index k = 0; k < 3; ++k) {
      const double expected = run.channels[c].value[k], value = back.channels[c].value[k];
      if (std::isnan(expected))
        EXPECT_TRUE(std::isnan(value));
      else
        EXPECT_NEAR(value, expected, 1e-9 * std::abs(expected)) << run.channels[c].name << ": ten digits";
    }
  }
  EXPECT_THAT(written, HasSubstr("# # a remark\n"));
  EXPECT_THAT(written, HasSubstr("alpha [deg],gauge [N],force [lbf],bath [K],colour [bogus],weight [1]\n"))
      << "the file's units, SI where a calibration or an offset lay between";
  EXPECT_THAT(written, HasSubstr("\n0,1.5,nan,2,"));
}

TEST(RunText, EscapesWhatWouldEndAName) {
  unrig::Run run;
  run.name = "line\nbreak \\ \"quote\"";
  run.density = 1;
  run.channels.push_back({"gauge", "N", "N", 1, Eigen::VectorXd::Ones(3), 0});
  run.dt = 0.1;
  const test::TemporaryDirectory directory;
  EXPECT_EQ(read_run(directory.file("run.csv", run_text(run))).name, run.name);
}

}  // namespace
}  // namespace unrig
