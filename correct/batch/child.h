#pragma once
#include <sys/types.h>

#include <cstdio>
#include <functional>
#include <map>
#include <optional>
#include <string>

namespace unrig {

/// Pieces of work in processes of their own, so that one which crashes or takes all memory stops no other. They end with this process, however that ends.
///
/// A child begins as a copy of the whole process: start none while other threads hold a lock that a child needs (those of memory and files are free in it).
class Children {
 public:
  struct Ended {
    std::size_t job = 0;
    int status = 0;   ///< exit status; none if `signal` is set
    int signal = 0;   ///< that ended it
    std::string said; ///< on standard error
  };
  Children() = default;
  ~Children();
  Children(const Children&) = delete;
  Children& operator=(const Children&) = delete;

  /// `work` gets its own standard error to read back, and returns the exit status. Its standard output is dropped. Throws std::system_error where no process can be had.
  void start(std::size_t job, const std::function<int(std::FILE* said)>& work);
  std::size_t running() const { return jobs_.size(); }
  /// Waits for the end of any.
  Ended wait();

 private:
  struct Job {
    std::size_t number;
    std::FILE* said;
  };
  std::map<pid_t, Job> jobs_;
};

/// What a file holds from its beginning.
std::string whole(std::FILE* file);

}  // namespace unrig
