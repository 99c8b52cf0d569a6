// Rig files: a rig or InputError.
#include "core/files/error.h"
#include "core/rig/rig.h"
#include "tests/fuzz/on_disk.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const OnDisk file(data, size);
  try {
    unrig::read_rig(file.path());
  } catch (const unrig::InputError&) {
  }
  return 0;
}
