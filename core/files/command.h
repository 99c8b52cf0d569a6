#pragma once
#include <functional>
#include <string>

namespace unrig {

/// One command of the binary: how it is called and what it does. Each stands on the lowest floor that can carry it; `correct/main.cpp` lists them.
struct Command {
  const char* name;
  const char* summary;  ///< one line
  int (*run)(int argc, char** argv);  ///< argv[0] is the command's name; returns the exit status
};

/// Exit statuses (correct/manual/results.md).
enum ExitStatus : int { exit_done = 0, exit_no_answer = 1, exit_wrong_use = 2 };

/// Writes progress to standard error, on a terminal only: one line that is overwritten, removed by `clear`.
class Progress {
 public:
  Progress();
  ~Progress() { clear(); }
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;
  void operator()(const std::string& what);
  void clear();

 private:
  bool terminal_;
  bool shown_ = false;
};

/// Warnings go to standard error, each on a line of its own.
void warn(const std::string& warning);

}  // namespace unrig
