#include "core/numerics/in_parallel.h"

#include <algorithm>
#include <atomic>
#include <exception>
#include <mutex>
#include <thread>
#include <vector>

#include "core/numerics/time_limit.h"
#include "core/numerics/work.h"

namespace unrig {
namespace {

std::atomic<int>& idle() {
  static std::atomic<int> threads{static_cast<int>(std::max(1u, std::thread::hardware_concurrency())) - 1};
  return threads;
}

bool take_one() {
  int left = idle();
  while (left > 0)
    if (idle().compare_exchange_weak(left, left - 1)) return true;
  return false;
}

/// Puts back what this thread has counted for itself.
class OwnWork {
 public:
  OwnWork() : done_(work::done), most_(work::most), lifted_(work::lifted) {}
  ~OwnWork() {
    work::done = done_;
    work::most = most_;
    work::lifted = lifted_;
  }
  OwnWork(const OwnWork&) = delete;
  OwnWork& operator=(const OwnWork&) = delete;

 private:
  std::uint64_t done_, most_;
  bool lifted_;
};

}  // namespace

void use_threads(int threads) { idle() = std::max(1, threads) - 1; }

void in_parallel(std::size_t count, const std::function<void(std::size_t)>& call) {
  std::atomic<std::size_t> next{0};
  std::atomic<std::uint64_t> done{0};
  const std::uint64_t left = work::most - std::min(work::done, work::most);
  TimeLimit::check();
  std::exception_ptr failure;
  std::mutex failing;
  const auto fail = [&] {
    const std::lock_guard lock(failing);
    if (!failure) failure = std::current_exception();
  };
  const auto worker = [&] {
    const OwnWork own;
    for (std::size_t i = next++; i < count; i = next++) {
      work::done = 0;
      work::most = left;
      try {
        TimeLimit::check();
        call(i);
      } catch (const OutOfWork&) {  // the other calls are made all the same
        fail();
      } catch (...) {
        fail();
        next = count;
      }
      done += work::done;
    }
  };
  std::vector<std::thread> others;
  while (others.size() + 1 < count && take_one())
    others.emplace_back([&] {
      worker();
      ++idle();
    });
  worker();
  for (std::thread& thread : others) thread.join();
  work::done += done;
  if (failure) std::rethrow_exception(failure);
}

}  // namespace unrig
