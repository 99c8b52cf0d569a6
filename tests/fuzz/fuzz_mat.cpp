// MATLAB files: a recording or InputError. The bytes mostly go through libmatio, whose own faults are found here too.
#include "core/error.h"
#include "core/import/mat.h"
#include "tests/fuzz/on_disk.h"

/// What libmatio asks for on the word of the file may be refused, as it is without a sanitizer; it must cope.
extern "C" const char* __asan_default_options() { return "allocator_may_return_null=1"; }

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const OnDisk file(data, size);
  try {
    unrig::read_mat(file.path());
  } catch (const unrig::InputError&) {
  }
  return 0;
}
