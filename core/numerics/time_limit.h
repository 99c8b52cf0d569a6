#pragma once

namespace unrig {

/// Processor time that this process has taken so far, of all its threads [s].
double processor_seconds();

/// in_parallel had no more time. It is no std::exception: who catches those does not catch it by mistake.
struct OutOfTime {};

/// As long as it lives, in_parallel throws OutOfTime in place of its next call once the process has taken so much processor time in all [s]. One at a time: processor time is the whole process's.
///
/// It ends a search between two pieces of work; what these work on may be left half done.
class TimeLimit {
 public:
  explicit TimeLimit(double processor_seconds);
  ~TimeLimit() { lift(); }
  TimeLimit(const TimeLimit&) = delete;
  TimeLimit& operator=(const TimeLimit&) = delete;

  /// From here on nothing is stopped: for those who catch OutOfTime and tell what there is.
  static void lift();
  static bool is_lifted();
  /// Throws OutOfTime where the time is up.
  static void check();
};

}  // namespace unrig
