#include "fit/diagnose/mismatch.h"

#include <gtest/gtest.h>

namespace unrig {
namespace {

TEST(Mismatch, NamesPowersAsOneSaysThem) {
  EXPECT_EQ(in_words_of_power(1.04), "in proportion to");
  EXPECT_EQ(in_words_of_power(1.98), "with the square of");
  EXPECT_EQ(in_words_of_power(2.9), "with the cube of");
  EXPECT_EQ(in_words_of_power(1.43), "with the power 1.4 of");
  EXPECT_EQ(in_words_of_power(0.5), "with the power 0.5 of");
}

}  // namespace
}  // namespace unrig
