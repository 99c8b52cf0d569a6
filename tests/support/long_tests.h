#pragma once

#include <cstdlib>

namespace unrig::test {

/// Whether UNRIG_LONG asks for the tests that take minutes.
inline bool long_tests_wanted() { return std::getenv("UNRIG_LONG") != nullptr; }

}  // namespace unrig::test
