#include "core/numerics/time_limit.h"

#include <gtest/gtest.h>

#include <atomic>
#include <exception>

#include "core/numerics/in_parallel.h"
#include "core/numerics/work.h"

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

/// Calls in two levels, each of `more` work than the one before it; what was done when they ended, and how many ended.
struct Counted {
  std::uint64_t done = 0;
  int ended = 0;
  bool stopped = false;
};
Counted count(int threads, std::uint64_t most) {
  use_threads(threads);
  Counted counted;
  std::atomic<int> ended = 0;
  const std::uint64_t before = work_done();
  {
    const WorkLimit limit(most);
    try {
      for (int round = 0; round < 3; ++round)
        in_parallel(4, [&](std::size_t i) {
          for (int part = 0; part < 2; ++part) {
            in_parallel(2, [&](std::size_t) { count_work(10 * static_cast<std::int64_t>(i + 1)); });
            ++ended;
          }
        });
    } catch (const OutOfWork&) {
      counted.stopped = true;
    }
  }
  counted.done = work_done() - before;
  counted.ended = ended;
  use_threads(8);
  return counted;
}

TEST(WorkLimit, StopsAtTheSameWorkHoweverManyThreadsThereAre) {
  const Counted all = count(1, 1'000'000);
  EXPECT_FALSE(all.stopped);
  EXPECT_EQ(all.done, 3u * 4u * (10 + 20 + 30 + 40));
  EXPECT_EQ(all.ended, 24);
  for (const std::uint64_t most : {15u, 70u, 450u, 790u}) {
    const Counted one = count(1, most), many = count(8, most);
    EXPECT_TRUE(one.stopped) << most;
    EXPECT_EQ(one.done, many.done) << most;
    EXPECT_EQ(one.ended, many.ended) << most;
    EXPECT_LT(one.ended, 24) << most;
  }
}

TEST(WorkLimit, AllowsNoMoreThanTheOneAroundIt) {
  const auto stops_after = [](std::uint64_t work) {
    count_work(static_cast<std::int64_t>(work));
    try {
      TimeLimit::check();
    } catch (const OutOfWork&) {
      return true;
    }
    return false;
  };
  {
    const WorkLimit around(100);
    {
      const WorkLimit inside(1000);
      EXPECT_FALSE(stops_after(100));
      EXPECT_TRUE(stops_after(1));
    }
    TimeLimit::lift();
    EXPECT_FALSE(stops_after(1000));
  }
  EXPECT_FALSE(stops_after(1000)) << "it is gone";
}

}  // namespace
}  // namespace unrig
