#include "core/numerics/in_parallel.h"

#include <algorithm>
#include <atomic>
#include <exception>
#include <mutex>
#include <thread>
#include <vector>

#include "core/numerics/time_limit.h"

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

}  // namespace

void use_threads(int threads) { idle() = std::max(1, threads) - 1; }

void in_parallel(std::size_t count, const std::function<void(std::size_t)>& work) {
  std::atomic<std::size_t> next{0};
  std::exception_ptr failure;
  std::mutex failing;
  const auto worker = [&] {
    for (std::size_t i = next++; i < count; i = next++) try {
        TimeLimit::check();
        work(i);
      } catch (...) {
        const std::lock_guard lock(failing);
        if (!failure) failure = std::current_exception();
        next = count;
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
  if (failure) std::rethrow_exception(failure);
}

}  // namespace unrig
