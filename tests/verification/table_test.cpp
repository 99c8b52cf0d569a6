// The table of the seed's numbers in README.md beside this file is the one computed here. tests/verification/table.sh prints it.

#include "tests/verification/table.h"

#include <gtest/gtest.h>

#include <string>

#include "core/files/text_file.h"

namespace unrig::seed {
namespace {

TEST(SeedTable, StandsInTheReadme) {
  const std::string table = number_by_number(), readme = read_text(std::string(UNRIG_SOURCE_DIR) + "/tests/verification/README.md");
  const bool stands = readme.find(table) != std::string::npos;
  EXPECT_TRUE(stands) << "Put the lines that `sh tests/verification/table.sh` prints in place of the table of tests/verification/README.md.";
}

/// Run by table.sh alone: standard output is the table.
TEST(SeedTable, DISABLED_Print) { std::fputs(number_by_number().c_str(), stdout); }

}  // namespace
}  // namespace unrig::seed
