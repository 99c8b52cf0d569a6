#include "tests/support/shared_data.h"

#include <cstdlib>
#include <filesystem>

namespace unrig::test {

std::string shared_path(const std::string& relative) {
  const char* folder = std::getenv("UNRIG_SHARED");
  const auto root = folder != nullptr && *folder != '\0' ? std::filesystem::path(folder)
                                                         : std::filesystem::path(UNRIG_SOURCE_DIR).parent_path() / "shared";
  return (root / relative).string();
}

bool has_shared(const std::string& relative) {
  std::error_code unreadable;
  return std::filesystem::exists(shared_path(relative), unreadable);
}

std::string missing_shared(const std::string& relative) {
  return shared_path(relative) +
         " is not there: it is not part of the project. sample_data/README.md says where to fetch it; set "
         "UNRIG_SHARED to the folder that holds " +
         relative + ".";
}

}  // namespace unrig::test
