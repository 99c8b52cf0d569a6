#include "core/numerics/time_limit.h"

#include <algorithm>
#include <atomic>
#include <ctime>
#include <limits>

#include "core/numerics/work.h"

namespace unrig {

namespace work {
constinit thread_local std::uint64_t done = 0, most = std::numeric_limits<std::uint64_t>::max();
constinit thread_local bool lifted = true;
}  // namespace work

namespace {

constexpr double none = std::numeric_limits<double>::infinity();

std::atomic<double>& until() {
  static std::atomic<double> seconds{none};
  return seconds;
}

}  // namespace

std::uint64_t work_done() { return work::done; }

double processor_seconds() {
  timespec now{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

TimeLimit::TimeLimit(double processor_seconds) {
  until() = processor_seconds;
  work::lifted = false;
}

TimeLimit::~TimeLimit() {
  until() = none;
  work::lifted = true;
}

void TimeLimit::lift() {
  until() = none;
  work::most = std::numeric_limits<std::uint64_t>::max();
  work::lifted = true;
}

bool TimeLimit::is_lifted() { return work::lifted; }

void TimeLimit::check() {
  if (work::done > work::most) throw OutOfWork{};
  if (const double limit = until(); limit < none && processor_seconds() > limit) throw OutOfTime{};
}

WorkLimit::WorkLimit(std::uint64_t more) : around_(work::most) {
  constexpr std::uint64_t any = std::numeric_limits<std::uint64_t>::max();
  work::most = std::min(around_, more < any - work::done ? work::done + more : any);
}

WorkLimit::~WorkLimit() { work::most = around_; }

}  // namespace unrig
