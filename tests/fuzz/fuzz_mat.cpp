// MATLAB 5: a recording or InputError. Packed numbers are up to 1032 times as many as bytes.
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "core/files/error.h"
#include "core/import/mat5.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  try {
    const unrig::Recording r = unrig::read_mat5({reinterpret_cast<const char*>(data), size}, "fuzz.mat");
    for (const unrig::RecordedChannel& channel : r.channels)
      if (channel.value.size() > 1032 * size) std::abort();
  } catch (const unrig::InputError&) {
  }
  return 0;
}
