#include "core/files/questions.h"

#include <filesystem>
#include <sstream>

#include "core/files/error.h"

namespace unrig {

int questions_in(const std::string& text) {
  std::istringstream lines(text);
  int questions = 0;
  bool within = false;  // several lines of one question
  for (std::string line; std::getline(lines, line);) {
    const bool asks = line.starts_with("# ?") || line.starts_with("# # ?");
    questions += asks && !within;
    within = asks;
  }
  return questions;
}

void refuse_overwriting(const std::string& path, bool force) {
  if (path.empty() || force || path.starts_with("/dev/") || !std::filesystem::exists(path)) return;
  throw InputError({path, 0}, "the file exists", "wanted a new name", "--force writes over it.");
}

}  // namespace unrig
