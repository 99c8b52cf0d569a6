#include "core/numerics/time_limit.h"

#include <gtest/gtest.h>

#include <atomic>
#include <exception>

#include "core/numerics/in_parallel.h"

namespace unrig {
namespace {

void work_for(double seconds) {
  const double until = processor_seconds() + seconds;
  while (processor_seconds() < until) {
  }
}

TEST(TimeLimit, EndsLoopsHoweverTheyNestBetweenTwoPiecesOfWork) {
  const TimeLimit limit(processor_seconds() + 0.05);
  std::atomic<int> begun = 0, ended = 0;
  EXPECT_THROW(in_parallel(1000, [&](std::size_t) {
                 in_parallel(2, [&](std::size_t) {
                   ++begun;
                   work_for(0.01);
                   ++ended;
                 });
               }),
               OutOfTime);
  EXPECT_EQ(begun, ended);
  EXPECT_GE(begun, 1);
  EXPECT_LT(begun, 100);
}

TEST(TimeLimit, StopsNothingOnceItIsLiftedOrGone) {
  const auto count = [] {
    std::atomic<int> done = 0;
    in_parallel(3, [&](std::size_t) { ++done; });
    return done.load();
  };
  {
    const TimeLimit limit(processor_seconds());
    work_for(0.001);
    EXPECT_FALSE(TimeLimit::is_lifted());
    EXPECT_THROW(count(), OutOfTime);
    TimeLimit::lift();
    EXPECT_TRUE(TimeLimit::is_lifted());
    EXPECT_EQ(count(), 3);
  }
  { const TimeLimit limit(processor_seconds()); }
  EXPECT_EQ(count(), 3);
}

TEST(TimeLimit, IsNotCaughtAsAnError) {
  const TimeLimit limit(0);
  try {
    TimeLimit::check();
    ADD_FAILURE() << "the time was up";
  } catch (const std::exception&) {
    ADD_FAILURE() << "out of time is no error";
  } catch (const OutOfTime&) {
  }
}

TEST(TimeLimit, CountsProcessorTime) {
  const double before = processor_seconds();
  work_for(0.02);
  EXPECT_GE(processor_seconds() - before, 0.02);
}

}  // namespace
}  // namespace unrig
