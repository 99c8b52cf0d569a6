// Text tables and LabVIEW's, as they are and as several [format] have them: a recording or InputError, and every channel as long as the others and no longer than the file has lines.
#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <string>

#include "core/files/error.h"
#include "core/import/delimited.h"
#include "core/import/lvm.h"

namespace {

void read(const std::string& text, const unrig::DelimitedFormat& format) {
  const auto lines = static_cast<std::size_t>(std::count_if(text.begin(), text.end(), [](char c) { return c == '\n' || c == '\r'; })) + 1;
  try {
    const unrig::Recording r = unrig::is_lvm(text) ? unrig::read_lvm(text, "fuzz.lvm", format) : unrig::read_delimited(text, "fuzz.txt", format);
    if (r.channels.empty()) std::abort();
    for (const unrig::RecordedChannel& channel : r.channels)
      if (channel.value.size() != r.channels.front().value.size() || channel.value.empty() || channel.value.size() > lines) std::abort();
  } catch (const unrig::InputError&) {
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string text = unrig::in_utf8({reinterpret_cast<const char*>(data), size});
  read(text, {});
  read(text, {"", ",", 0, {}, ".", {"ERR"}});
  read(text, {",", ",", 1, true, "", {}});
  read(text, {"blanks", ".", 0, false, "'", {"#N/A", "-9999"}});
  return 0;
}
