#include "core/files/heard_warnings.h"

namespace unrig {
namespace {

thread_local HeardWarnings* listening = nullptr;

}  // namespace

HeardWarnings::HeardWarnings() : outer_(listening) { listening = this; }
HeardWarnings::~HeardWarnings() { listening = outer_; }

bool heard(const std::string& line) {
  if (!listening) return false;
  listening->lines_.push_back(line);
  return true;
}

}  // namespace unrig
