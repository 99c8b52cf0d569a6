#pragma once
#include <cstdint>

namespace unrig {

/// Processor time that this process has taken so far, of all its threads [s].
double processor_seconds();

/// in_parallel had no more time. It is no std::exception: who catches those does not catch it by mistake.
struct OutOfTime {};
/// The same of work that is counted.
struct OutOfWork : OutOfTime {};

/// As long as it lives, in_parallel throws OutOfTime in place of its next call once the process has taken so much processor time in all [s]. One at a time: processor time is the whole process's.
///
/// It ends a search between two pieces of work; what these work on may be left half done.
class TimeLimit {
 public:
  explicit TimeLimit(double processor_seconds);
  ~TimeLimit();
  TimeLimit(const TimeLimit&) = delete;
  TimeLimit& operator=(const TimeLimit&) = delete;

  /// From here on nothing that this thread does is stopped, by a WorkLimit neither: for those who catch OutOfTime and tell what there is.
  static void lift();
  static bool is_lifted();
  /// Throws OutOfTime where the time is up, OutOfWork where enough is done.
  static void check();
};

/// As long as it lives, in_parallel throws OutOfWork in place of its next call once this thread, with those that work for it, has done so much more work (core/numerics/work.h). They nest: none allows more than the one
/// around it.
///
/// Each of the calls of one in_parallel may do what was left where it began, and all of them are made: what is done does not depend on the number of threads.
class WorkLimit {
 public:
  explicit WorkLimit(std::uint64_t more);
  ~WorkLimit();
  WorkLimit(const WorkLimit&) = delete;
  WorkLimit& operator=(const WorkLimit&) = delete;

 private:
  std::uint64_t around_;
};

}  // namespace unrig
