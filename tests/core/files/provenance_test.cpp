#include "core/files/provenance.h"

#include <gtest/gtest.h>

#include <vector>

namespace unrig {
namespace {

std::string command_of(std::vector<const char*> words, const std::vector<std::string_view>& outputs = {}) { return provenance_of(static_cast<int>(words.size()), words.data(), outputs).command; }

TEST(Provenance, IsTheCommandWithoutWhereItWritesAndInHowManyThreads) {
  EXPECT_EQ(command_of({"fit", "--rig", "rig.toml", "a.csv", "-o", "fit.json"}), "unrig fit --rig rig.toml a.csv");
  EXPECT_EQ(command_of({"fit", "-ofit.json", "--output", "x", "--output=x", "--threads", "2", "--threads=2", "a.csv"}), "unrig fit a.csv");
  EXPECT_EQ(command_of({"trial", "--shard", "2/7", "--seed", "3"}), "unrig trial --seed 3");
  EXPECT_EQ(command_of({"correct", "--fit", "fit.json", "--indicial", "i.csv", "a.csv"}, {"--indicial"}), "unrig correct --fit fit.json a.csv");
  EXPECT_EQ(command_of({"fit", "-o"}), "unrig fit");
  EXPECT_EQ(command_of({"fit", "run of May's.csv", ""}), "unrig fit 'run of May'\\''s.csv' ''");
}

TEST(Provenance, StandsInTheNameOfAColumn) {
  const MadeBy made{{"unrig 0.1.0", "unrig correct --fit 'a; run=b' c.csv"}, "1a", "2b", "3c"};
  const std::string column = made.column();
  ASSERT_TRUE(column.starts_with(MadeBy::prefix));
  const MadeBy read = MadeBy::of_column(std::string_view(column).substr(MadeBy::prefix.size()));
  EXPECT_EQ(read.provenance.program, "unrig 0.1.0");
  EXPECT_EQ(read.provenance.command, made.provenance.command);
  EXPECT_EQ(read.rig + read.run + read.fit, "1a2b3c");
  EXPECT_EQ(MadeBy{}.column(), "");
  EXPECT_EQ(MadeBy::of_column("anything").rig, "");
}

}  // namespace
}  // namespace unrig
