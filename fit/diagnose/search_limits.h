#pragma once
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>

#include "core/numerics/time_limit.h"
#include "core/numerics/work.h"
#include "fit/diagnose/diagnose.h"

namespace unrig {

/// What a diagnosis may take, over the parts of it that search.
class SearchLimits {
 public:
  explicit SearchLimits(const DiagnoseProblem& problem) : until_(problem.limit > 0 ? processor_seconds() + problem.limit : INFINITY), most_(problem.work > 0 ? problem.work : INFINITY) {}

  bool are_reached() const { return are_reached_; }
  /// 1e9 multiplications.
  double work() const { return done_; }
  /// Searches unless a limit is reached; what the search has changed by then stands.
  void spend(const std::function<void()>& search) {
    if (are_reached_) return;
    const std::uint64_t before = work_done();
    are_reached_ = !is_done_within(until_, most_ - done_, search);
    done_ += static_cast<double>(work_done() - before) / billion;
    are_reached_ = are_reached_ || done_ > most_;
  }
  /// Whether the description of what was found is done within a quarter of what a search may usually take; of a search without limits always.
  bool describe(const std::function<void()>& description) const {
    constexpr double quarter = 0.25;
    return is_done_within(std::isinf(until_) ? until_ : processor_seconds() + quarter * usual_seconds, std::isinf(most_) ? most_ : quarter * usual_work, description);
  }

 private:
  static constexpr double billion = 1e9;
  static bool is_done_within(double until, double most, const std::function<void()>& task) {
    constexpr double any = 1e9;
    const TimeLimit time(until);
    const WorkLimit work(static_cast<std::uint64_t>(billion * std::min(any, most)));
    try {
      task();
      return !TimeLimit::is_lifted();
    } catch (const OutOfTime&) {
      return false;
    }
  }

  double until_, most_, done_ = 0;
  bool are_reached_ = false;
};

}  // namespace unrig
