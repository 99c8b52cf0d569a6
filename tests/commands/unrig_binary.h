#pragma once
#include <cstdlib>
#include <string>

namespace unrig::test {

/// The binary under test: the one that was built with the tests, unless UNRIG_TESTED_BINARY names another (the one under the sanitizers).
inline std::string unrig_binary() {
  const char* other = std::getenv("UNRIG_TESTED_BINARY");
  return other ? other : UNRIG_BINARY;
}

}  // namespace unrig::test
