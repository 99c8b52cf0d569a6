// Universal files: a recording or InputError, and every channel a number of values that the file can hold.
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "core/files/error.h"
#include "core/import/uff.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  try {
    const unrig::Recording r = unrig::read_uff({reinterpret_cast<const char*>(data), size}, "fuzz.uff");
    for (const unrig::RecordedChannel& channel : r.channels)
      if (channel.value.size() > size) std::abort();
  } catch (const unrig::InputError&) {
  }
  try {
    for (const unrig::UffFunction& f : unrig::read_uff_functions({reinterpret_cast<const char*>(data), size}, "fuzz.uff"))
      if (f.value.size() > size || f.abscissa.size() != f.value.size()) std::abort();
  } catch (const unrig::InputError&) {
  }
  return 0;
}
