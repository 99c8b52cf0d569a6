#pragma once
#include <string>
#include <vector>

namespace unrig {

/// While it lives, what this thread says by `warn` and by `tell` (core/check/gate.h) is kept here, and standard error stays silent: for callers that have another way to say it.
class HeardWarnings {
 public:
  HeardWarnings();
  ~HeardWarnings();
  HeardWarnings(const HeardWarnings&) = delete;
  HeardWarnings& operator=(const HeardWarnings&) = delete;
  const std::vector<std::string>& lines() const { return lines_; }

 private:
  friend bool heard(const std::string& line);
  std::vector<std::string> lines_;
  HeardWarnings* outer_;
};

/// Hands a line to the HeardWarnings of this thread; false where there is none.
bool heard(const std::string& line);

}  // namespace unrig
