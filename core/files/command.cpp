#include "core/files/command.h"
#include "core/files/heard_warnings.h"
#include "core/files/last_progress.h"
#include "core/files/verbosity.h"

#include <unistd.h>

#include <chrono>
#include <cstdio>
#include <set>

namespace unrig {

namespace {

void erase_line() { std::fputs("\r\033[K", stderr); }

std::string last_told;
bool line_shown = false;  // a warning must not begin at the end of it
Verbosity verbosity = Verbosity::normal;

using Clock = std::chrono::steady_clock;
const Clock::time_point begun = Clock::now();
Clock::time_point last_line = begun;

double seconds_since(Clock::time_point then) { return std::chrono::duration<double>(Clock::now() - then).count(); }

/// In a log, which shows no line that comes and goes.
void tell_the_log(const std::string& what) {
  constexpr double heartbeat = 30;  // seconds
  if (verbosity != Verbosity::verbose && seconds_since(last_line) < heartbeat) return;
  last_line = Clock::now();
  std::fprintf(stderr, "progress: %s (%.0f s gone)\n", what.c_str(), seconds_since(begun));
}

}  // namespace

void set_verbosity(Verbosity wanted) { verbosity = wanted; }

Progress::Progress() : terminal_(isatty(STDERR_FILENO) == 1) {}

void Progress::operator()(const std::string& what) {
  last_told = what;
  if (verbosity == Verbosity::quiet) return;
  if (!terminal_ || verbosity == Verbosity::verbose) return tell_the_log(what);
  constexpr double long_since = 2;  // seconds
  const double gone = seconds_since(begun);
  if (gone < long_since) std::fprintf(stderr, "\r\033[K%s ...", what.c_str());
  else std::fprintf(stderr, "\r\033[K%s (%.0f s gone) ...", what.c_str(), gone);
  std::fflush(stderr);
  shown_ = line_shown = true;
}

void Progress::clear() {
  if (shown_ && line_shown) erase_line();
  shown_ = line_shown = false;
}

const std::string& last_progress() { return last_told; }

void warn(const std::string& warning) {
  if (heard(warning) || verbosity == Verbosity::quiet) return;
  static std::set<std::string> said;  // each once per call of the program
  if (!said.insert(warning).second) return;
  if (line_shown) erase_line();
  line_shown = false;
  std::fprintf(stderr, "warning: %s\n", warning.c_str());
}

}  // namespace unrig
