#include "core/numerics/time_limit.h"

#include <atomic>
#include <ctime>
#include <limits>

namespace unrig {
namespace {

constexpr double none = std::numeric_limits<double>::infinity();

std::atomic<double>& until() {
  static std::atomic<double> seconds{none};
  return seconds;
}

}  // namespace

double processor_seconds() {
  timespec now{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

TimeLimit::TimeLimit(double processor_seconds) { until() = processor_seconds; }

void TimeLimit::lift() { until() = none; }

bool TimeLimit::is_lifted() { return until() == none; }

void TimeLimit::check() {
  if (const double limit = until(); limit < none && processor_seconds() > limit) throw OutOfTime{};
}

}  // namespace unrig
