#pragma once
#include <gtest/gtest.h>

#include <string>

namespace unrig::test {

/// Path of `relative` ("real/ship_roll/run_21337.csv") in the folder of recordings that may not be copied into the project:
/// $UNRIG_SHARED where it is set, otherwise `shared` beside the checkout.
std::string shared_path(const std::string& relative);

/// Whether that file or folder is there.
bool has_shared(const std::string& relative);

/// What a skipped test says: what is missing, and where to get it.
std::string missing_shared(const std::string& relative);

}  // namespace unrig::test

/// Skips the test, in its own body or SetUp(), where the recording is absent.
#define UNRIG_NEEDS_SHARED(relative) \
  if (!unrig::test::has_shared(relative)) GTEST_SKIP() << unrig::test::missing_shared(relative)
