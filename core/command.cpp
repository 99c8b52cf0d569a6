#include "core/command.h"

#include <unistd.h>

#include <cstdio>

namespace unrig {

Progress::Progress() : terminal_(isatty(STDERR_FILENO) == 1) {}

void Progress::operator()(const std::string& what) {
  if (!terminal_) return;
  std::fprintf(stderr, "\r\033[K%s ...", what.c_str());
  std::fflush(stderr);
  shown_ = true;
}

void Progress::clear() {
  if (shown_) std::fputs("\r\033[K", stderr);
  shown_ = false;
}

void warn(const std::string& warning) { std::fprintf(stderr, "warning: %s\n", warning.c_str()); }

}  // namespace unrig
