#include "core/numerics/in_parallel.h"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <set>
#include <stdexcept>
#include <thread>
#include <vector>

namespace unrig {
namespace {

struct Threads {  // as many as a test asks for, the machine's afterwards
  explicit Threads(int threads) { use_threads(threads); }
  ~Threads() { use_threads(static_cast<int>(std::thread::hardware_concurrency())); }
};

TEST(InParallel, DoesEveryPieceOnceHoweverLoopsNest) {
  for (const int threads : {1, 2, 5}) {
    const Threads these(threads);
    std::vector<std::atomic<int>> done(12 * 7);
    in_parallel(12, [&](std::size_t i) { in_parallel(7, [&](std::size_t j) { ++done[7 * i + j]; }); });
    for (const auto& count : done) EXPECT_EQ(count, 1);
  }
}

TEST(InParallel, NeverUsesMoreThreadsThanItMay) {
  const Threads these(3);
  std::atomic<int> busy{0}, most{0};
  for (int again = 0; again < 3; ++again)  // threads are given back
    in_parallel(4, [&](std::size_t) {
      in_parallel(4, [&](std::size_t) {
        const int now = ++busy;
        for (int seen = most; now > seen && !most.compare_exchange_weak(seen, now);) {}
        std::this_thread::sleep_for(std::chrono::milliseconds(2));
        --busy;
      });
    });
  EXPECT_LE(most, 3);
  EXPECT_GE(most, 2);
}

TEST(InParallel, ThrowsOnWhatAPieceThrows) {
  for (const int threads : {1, 4}) {
    const Threads these(threads);
    EXPECT_THROW(in_parallel(20, [](std::size_t i) { if (i == 3) throw std::runtime_error("piece 3"); }), std::runtime_error);
    std::atomic<int> done{0};
    in_parallel(20, [&](std::size_t) { ++done; });
    EXPECT_EQ(done, 20);
  }
}

TEST(InParallel, DoesNothingForNoPieces) {
  in_parallel(0, [](std::size_t) { FAIL(); });
}

}  // namespace
}  // namespace unrig
