// In place of libFuzzer: feeds a fuzzer's corpus to it once. Ends with the first finding of the sanitizers.
#include <cstdint>
#include <cstdio>
#include <filesystem>

#include "core/files/text_file.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

int main(int count, char** folders) {
  int fed = 0;
  for (int i = 1; i < count; ++i)
    for (const auto& entry : std::filesystem::directory_iterator(folders[i])) {
      const std::string bytes = unrig::read_text(entry.path().string());
      std::printf("%s\n", entry.path().c_str());
      std::fflush(stdout);
      for (std::size_t length = 0; length <= bytes.size(); length += 1 + length / 8)  // cut off in many places too
        LLVMFuzzerTestOneInput(reinterpret_cast<const std::uint8_t*>(bytes.data()), length), ++fed;
      LLVMFuzzerTestOneInput(reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size());
    }
  std::printf("%d inputs\n", fed);
  return fed > 0 ? 0 : 1;
}
