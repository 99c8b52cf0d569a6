#include "core/files/command.h"
#include "core/files/last_progress.h"

#include <unistd.h>

#include <cstdio>
#include <set>

namespace unrig {

namespace {

void erase_line() { std::fputs("\r\033[K", stderr); }

std::string last_told;
bool line_shown = false;  // a warning must not begin at the end of it

}  // namespace

Progress::Progress() : terminal_(isatty(STDERR_FILENO) == 1) {}

void Progress::operator()(const std::string& what) {
  last_told = what;
  if (!terminal_) return;
  std::fprintf(stderr, "\r\033[K%s ...", what.c_str());
  std::fflush(stderr);
  shown_ = line_shown = true;
}

void Progress::clear() {
  if (shown_ && line_shown) erase_line();
  shown_ = line_shown = false;
}

const std::string& last_progress() { return last_told; }

void warn(const std::string& warning) {
  static std::set<std::string> said;  // each once per call of the program
  if (!said.insert(warning).second) return;
  if (line_shown) erase_line();
  line_shown = false;
  std::fprintf(stderr, "warning: %s\n", warning.c_str());
}

}  // namespace unrig
