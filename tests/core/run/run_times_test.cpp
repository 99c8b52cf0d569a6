// Times of a run file: stamps that are rounded, jitter, repeat or leave a gap.

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <string>
#include <vector>

#include "core/run/run.h"
#include "tests/core/run/written_run.h"
#include "tests/support/replaced.h"

namespace unrig {
namespace {

using test::head;
using test::read;
using test::refusal;
using test::replaced;
using test::small_table;
using test::values;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

/// A run whose channel `gauge` is a function of the time that is written beside it.
std::string run_of(const std::vector<double>& times, const std::function<double(double)>& gauge, int digits) {
  std::string text = head + "time [s],gauge [N]\n";
  for (const double t : times) text += fmt::format("{:.{}f},{:.17g}\n", t, digits, gauge(t));
  return text;
}

double line(double t) { return 3 - 2 * t; }

std::vector<double> uniform_times(int count, double step) {
  std::vector<double> times;
  for (int k = 0; k < count; ++k) times.push_back(step * k);
  return times;
}

TEST(RunTimes, RoundedStampsStayOnTheirGrid) {
  // 600 Hz printed to the millisecond: intervals of 1 and 2 ms that are no jitter. The step of a least-squares line through n roundings to
  // q is known to q / n^1.5; first and last stamp alone would leave q / n.
  const int count = 600;
  const unrig::Run run = read(run_of(uniform_times(count, 1 / 600.0), line, 3));
  EXPECT_FALSE(run.resampled);
  EXPECT_NEAR(run.dt, 1 / 600.0, 1e-3 / std::pow(count, 1.5));
  EXPECT_NEAR(run.start, 0, 1e-3 / std::sqrt(count) * 2);
  EXPECT_DOUBLE_EQ(run.channel("gauge").value[100], line(100 / 600.0));
  EXPECT_THAT(run.warnings, IsEmpty());
}

TEST(RunTimes, JitterIsInterpolatedAway) {
  std::vector<double> times = uniform_times(101, 0.01);
  for (int k = 1; k < 100; ++k) times[k] += 0.004 * std::sin(7.0 * k);
  const unrig::Run run = read(run_of(times, line, 9));
  EXPECT_TRUE(run.resampled);
  EXPECT_NEAR(run.largest_jitter, 0.004, 1e-6);  // of 99 sines the largest is within 1e-4 of one
  EXPECT_DOUBLE_EQ(run.dt, 0.01);
  EXPECT_THAT(run.warnings, ElementsAre(HasSubstr("jitter")));
  for (Eigen::Index k = 0; k < run.samples(); ++k) {
    // Linear interpolation is exact for a line, up to the stamps' rounding to 1e-9 s at a slope of 2.
    EXPECT_NEAR(run.channel("gauge").value[k], line(run.time(k)), 2e-9) << k;
  }
}

TEST(RunTimes, InterpolationSpreadsMissingAndLeftOutSamples) {
  const unrig::Run run = read(head + "time [s],gauge [N],weight\n0,0,1\n1,,1\n2,2,1\n3.4,3.4,1\n4,4,0\n5,5,1\n6,6,1\n");
  ASSERT_TRUE(run.resampled);
  const auto gauge = values(run.channel("gauge"));
  EXPECT_EQ(gauge[0], 0);
  EXPECT_TRUE(std::isnan(gauge[1]));
  EXPECT_EQ(gauge[2], 2);
  EXPECT_DOUBLE_EQ(gauge[3], 3);
  EXPECT_THAT(values(run.channel("weight")), ElementsAre(1, 1, 1, 1, 0, 1, 1));
  EXPECT_EQ(run.channel("gauge").missing, 1u);

  // A time of the grid between a sample that counts and one that does not does not count.
  const unrig::Run late = read(head + "time [s],gauge [N],weight\n0,0,1\n1,1,0\n2.4,2.4,1\n3,3,1\n4,4,1\n");
  EXPECT_THAT(values(late.channel("weight")), ElementsAre(1, 0, 0, 1, 1));
}

TEST(RunTimes, AGapIsReportedWithItsPlace) {
  std::vector<double> times = uniform_times(50, 0.01);
  for (std::size_t k = 20; k < times.size(); ++k) times[k] += 0.01;  // one sample is missing
  EXPECT_THAT(refusal(run_of(times, line, 4)), AllOf(HasSubstr("step_a.csv:26: "), HasSubstr("from 0.19 to 0.21 s")));
}

TEST(RunTimes, AGapInCoarselyPrintedTimesIsNoRounding) {
  // 2 ms printed to the millisecond, as the campaigns are, and 600 Hz: after a missing sample the interval is two or three digits longer.
  for (const double step : {0.002, 1 / 600.0}) {
    std::vector<double> times = uniform_times(300, step);
    for (std::size_t k = 151; k < times.size(); ++k) times[k] += step;
    EXPECT_THAT(refusal(run_of(times, line, 3)), HasSubstr("gap")) << step;
  }
}

TEST(RunTimes, ALateStampThatIsMadeUpIsNoGap) {
  std::vector<double> times = uniform_times(50, 0.01);
  times[20] += 0.008;
  const unrig::Run run = read(run_of(times, line, 4));
  EXPECT_TRUE(run.resampled);
  EXPECT_NEAR(run.largest_jitter, 0.008, 1e-9);
}

TEST(RunTimes, ARepeatedStampAfterALateOneIsSpread) {
  std::vector<double> times = uniform_times(50, 0.01);
  times[20] = times[21];  // as in the force plate's recording
  const unrig::Run run = read(run_of(times, line, 4));
  EXPECT_FALSE(run.resampled);
  EXPECT_NEAR(run.dt, 0.01, 1e-15);
  EXPECT_THAT(run.warnings, ElementsAre(AllOf(HasSubstr(":27: "), HasSubstr("repeat"))));
}

/// Where a logger wrote a row twice the other rows are the recording, on their own grid. Interpolated to a grid of one row more, all of them
/// lay up to half a step off: the chi-square of a step rose from 1 to 2.09.
TEST(RunTimes, ARowThatStandsTwiceIsLeftOut) {
  const int count = 400;
  for (const double other_reading : {0.0, 0.5})  // the same readings, or others at the same instant
    for (const int row : {0, 200, 399}) {
      SCOPED_TRACE(row);
      std::string text = head + "time [s],gauge [N]\n";
      for (int k = 0; k < count; ++k) {
        text += fmt::format("{:.3f},{:.9g}\n", 0.002 * k, line(0.002 * k));
        if (k == row) text += fmt::format("{:.3f},{:.9g}\n", 0.002 * k, line(0.002 * k) + other_reading);
      }
      const unrig::Run run = read(text);
      EXPECT_FALSE(run.resampled);
      EXPECT_NEAR(run.dt, 0.002, 1e-12);
      ASSERT_EQ(run.samples(), count);
      for (int k = 0; k < count; ++k) EXPECT_NEAR(run.channel("gauge").value[k], line(0.002 * k), 1e-8) << k;  // nine digits were written
      EXPECT_THAT(run.warnings, ElementsAre(AllOf(HasSubstr(fmt::format("step_a.csv:{}: 1 row(s) repeat the time", 7 + row)), HasSubstr("left out"))));
    }
}

TEST(RunTimes, WhatFollowsALeftOutRowKeepsItsLine) {
  const std::string good = head + "time [s],gauge [N]\n0.000,1\n0.002,2\n0.002,2\n0.004,3\n0.006,4\n0.008,5\n0.010,6\n0.012,7\n";
  EXPECT_EQ(read(good).samples(), 7);
  EXPECT_THAT(refusal(replaced(good, "0.010,6\n", "")), AllOf(HasSubstr("step_a.csv:12: "), HasSubstr("gap from 0.008 to 0.012 s")));
}

TEST(RunTimes, StampsTooCoarseForTheirSamplesAreNoRepeatedRows) {
  std::string text = head + "time [s],gauge [N]\n";  // 100 Hz printed to 20 ms: every stamp stands in two rows, of different readings
  for (int k = 0; k < 101; ++k) text += fmt::format("{:.2f},{}\n", 0.02 * ((k + 1) / 2), k);
  const unrig::Run run = read(text);
  EXPECT_EQ(run.samples(), 101);
  EXPECT_NEAR(run.dt, 0.01, 1e-12);
}

TEST(RunTimes, ASampleThatIsStampedEarlyIsMoved) {
  std::vector<double> times = uniform_times(50, 0.01);
  times[21] = times[20];
  const unrig::Run run = read(run_of(times, line, 4));
  EXPECT_FALSE(run.resampled);
  EXPECT_EQ(run.samples(), 50);
  EXPECT_NEAR(run.dt, 0.01, 1e-15);
  EXPECT_THAT(run.warnings, ElementsAre(AllOf(HasSubstr(":27: "), HasSubstr("spread"))));
}

TEST(RunTimes, JitterThroughoutAllowsLongerIntervals) {
  std::vector<double> times = uniform_times(200, 0.01);
  for (std::size_t k = 0; k < times.size(); ++k) times[k] += 0.002 * std::sin(7.0 * static_cast<double>(k));
  std::vector<double> four = times;
  for (std::size_t k = 100; k < times.size(); ++k) four[k] += 0.03;
  EXPECT_TRUE(read(run_of(four, line, 9)).resampled);
  std::vector<double> seven = times;
  for (std::size_t k = 100; k < times.size(); ++k) seven[k] += 0.06;
  EXPECT_THAT(refusal(run_of(seven, line, 9)), HasSubstr("gap"));
}

TEST(RunTimes, TimesThatDoNotIncrease) {
  EXPECT_THAT(refusal(replaced(head + small_table, "0.2,", "0.05,")), AllOf(HasSubstr(":8: "), HasSubstr("falls from 0.1 to 0.05 s")));
  EXPECT_THAT(refusal(replaced(head + small_table, "0.1,", "0.0,")), AllOf(HasSubstr(":7: "), HasSubstr("stands in two rows")));
  EXPECT_THAT(refusal(replaced(head + small_table, "0.1,", "nan,")), AllOf(HasSubstr(":7: "), HasSubstr("time is missing")));
  EXPECT_THAT(refusal(replaced(head + small_table, "0.1,", ",")), HasSubstr("time is missing"));
}

}  // namespace
}  // namespace unrig
