#pragma once
#include <stdexcept>
#include <string>

namespace unrig {

/// Unusable input: what a person can mend. The command ends with exit status 2.
///
/// The message has one shape everywhere: `FILE:LINE: FOUND; WANTED. ADVICE`. `line` 0 means the file as a whole.
class InputError : public std::runtime_error {
 public:
  struct Place {
    std::string file;
    int line = 0;
  };
  InputError(const Place& place, const std::string& found, const std::string& wanted, const std::string& advice);
};

/// The question was understood and has no trustworthy answer. The command ends with exit status 1.
class NoAnswer : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

}  // namespace unrig
