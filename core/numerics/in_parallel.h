#pragma once
#include <cstddef>
#include <functional>

namespace unrig {

/// How many threads in_parallel may keep busy altogether, 1 or more; at first as many as the machine has. Not to be called while in_parallel is at work.
void use_threads(int threads);

/// Calls work(0) to work(count - 1), each once, from this thread and from as many others as are idle, and returns when all are done. Calls may nest: a loop
/// inside of another takes the threads that the outer one leaves idle. The calls must not touch the same data. What the first that fails throws is thrown on;
/// OutOfTime where a limit of time has passed (core/numerics/time_limit.h).
void in_parallel(std::size_t count, const std::function<void(std::size_t)>& work);

}  // namespace unrig
