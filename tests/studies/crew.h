#pragma once
#include <atomic>
#include <cstdio>
#include <functional>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include <fmt/format.h>

#include "core/command.h"

namespace unrig::studies {

/// Does jobs 0 .. count-1 in `threads` threads, with a bar on a terminal. A job must not depend on another.
inline void each(int count, int threads, const std::function<void(int)>& job) {
  Progress progress;
  std::mutex bar;
  std::atomic<int> next = 0, done = 0;
  const auto work = [&] {
    for (int i = next++; i < count; i = next++) {
      job(i);
      const std::lock_guard guard(bar);
      const int finished = ++done;
      constexpr int width = 40;
      const auto filled = static_cast<std::size_t>(width * finished / count);
      progress(fmt::format("[{}{}] {} of {}", std::string(filled, '#'), std::string(width - filled, ' '), finished, count));
    }
  };
  std::vector<std::thread> crew;
  for (int t = 1; t < threads; ++t) crew.emplace_back(work);
  work();
  for (std::thread& member : crew) member.join();
}

}  // namespace unrig::studies
