// TDMS: a recording or InputError, and every channel a number of values that the file can hold.
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "core/files/error.h"
#include "core/import/tdms.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  try {
    const unrig::Recording r = unrig::read_tdms({reinterpret_cast<const char*>(data), size}, "fuzz.tdms");
    for (const unrig::RecordedChannel& channel : r.channels)
      if (channel.value.size() > size) std::abort();
  } catch (const unrig::InputError&) {
  }
  return 0;
}
