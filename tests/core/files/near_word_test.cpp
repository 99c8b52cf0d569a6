#include "core/files/near_word.h"

#include <gtest/gtest.h>

namespace unrig {
namespace {

TEST(NearWord, FindsWhatWasProbablyMeant) {
  const std::vector<std::string> commands{"import", "simulate", "fit", "apparent-mass", "diagnose", "correct"};
  EXPECT_EQ(nearest_word("fitt", commands), "fit");
  EXPECT_EQ(nearest_word("fti", commands), "fit");
  EXPECT_EQ(nearest_word("Diagnose", commands), "diagnose");
  EXPECT_EQ(nearest_word("aparent-mas", commands), "apparent-mass");
  EXPECT_EQ(nearest_word("correlate", commands), "") << "three letters";
  EXPECT_EQ(nearest_word("supper", commands), "");
  EXPECT_EQ(nearest_word("", commands), "");
}

TEST(NearWord, CountsEdits) {
  EXPECT_EQ(edits_between("alpha", "alpha"), 0u);
  EXPECT_EQ(edits_between("alpha", "alhpa"), 1u) << "neighbours swapped";
  EXPECT_EQ(edits_between("gauge", "gage"), 1u);
  EXPECT_EQ(edits_between("gage", "gauge"), 1u);
  EXPECT_EQ(edits_between("", "fit"), 3u);
  EXPECT_EQ(edits_between("kitten", "sitting"), 3u) << "Levenshtein's distance of the textbooks";
}

}  // namespace
}  // namespace unrig
