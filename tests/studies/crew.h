#pragma once
#include <functional>
#include <mutex>
#include <string>

#include <fmt/format.h>

#include "core/files/command.h"
#include "core/numerics/in_parallel.h"

namespace unrig::studies {

/// Does jobs 0 .. count-1 in `threads` threads, with a bar on a terminal. A job must not depend on another.
inline void each(int count, int threads, const std::function<void(int)>& job) {
  Progress progress;
  std::mutex bar;
  int done = 0;
  use_threads(threads);
  in_parallel(static_cast<std::size_t>(count), [&](std::size_t i) {
    job(static_cast<int>(i));
    const std::lock_guard guard(bar);
    constexpr int width = 40;
    const auto filled = static_cast<std::size_t>(width * ++done / count);
    progress(fmt::format("[{}{}] {} of {}", std::string(filled, '#'), std::string(width - filled, ' '), done, count));
  });
}

}  // namespace unrig::studies
