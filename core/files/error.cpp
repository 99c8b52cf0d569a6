#include "core/files/error.h"

#include <fmt/format.h>

namespace unrig {
namespace {

std::string message(const InputError::Place& place, const std::string& found, const std::string& wanted, const std::string& advice) {
  const std::string where = place.line > 0 ? fmt::format("{}:{}", place.file, place.line) : place.file;
  const std::string text = fmt::format("{}: {}; {}.", where, found, wanted);
  return advice.empty() ? text : text + " " + advice;
}

}  // namespace

InputError::InputError(const Place& place, const std::string& found, const std::string& wanted, const std::string& advice)
    : std::runtime_error(message(place, found, wanted, advice)) {}

}  // namespace unrig
