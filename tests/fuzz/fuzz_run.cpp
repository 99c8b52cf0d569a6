// Run files: whatever the bytes, parse_run returns a run or throws InputError.
#include <cstdint>
#include <string_view>

#include "core/files/error.h"
#include "core/run/run.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  try {
    unrig::parse_run({reinterpret_cast<const char*>(data), size}, "fuzz.csv");
  } catch (const unrig::InputError&) {
  }
  return 0;
}
