// MATLAB 5 files byte by byte: both byte orders, what is left out, and what is cut off or lies.

#include "core/import/mat5.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>

#include "core/files/error.h"

namespace unrig {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;
using Values = std::vector<double>;

/// Writes elements in one byte order ("MAT-File Format", tables 1-1 to 1-3).
struct Writer {
  bool big_endian = false;

  template <class T>
  std::string bytes(const std::vector<T>& numbers) const {
    std::string out;
    for (const T number : numbers) {
      std::string one(reinterpret_cast<const char*>(&number), sizeof(T));
      if (big_endian) std::reverse(one.begin(), one.end());
      out += one;
    }
    return out;
  }
  std::string element(std::uint32_t type, const std::string& data) const { return bytes<std::uint32_t>({type, static_cast<std::uint32_t>(data.size())}) + data + std::string((8 - data.size() % 8) % 8, '\0'); }
  /// Up to four bytes within the tag.
  std::string small_element(std::uint32_t type, const std::string& data) const {
    return bytes<std::uint32_t>({static_cast<std::uint32_t>(data.size()) << 16 | type}) + data + std::string(4 - data.size(), '\0');
  }
  std::string variable(std::uint32_t flags, const std::vector<std::int32_t>& size, const std::string& name, const std::string& rest) const {
    return element(14, element(6, bytes<std::uint32_t>({flags, 0})) + element(5, bytes(size)) + small_element(1, name) + rest);
  }
  std::string file(const std::string& elements) const { return "MATLAB 5.0" + std::string(114, ' ') + bytes<std::uint16_t>({0x100}) + (big_endian ? "MI" : "IM") + elements; }
};

TEST(Mat5, ReadsBothByteOrdersAndDoublesStoredAsIntegers) {
  for (const bool big_endian : {false, true}) {
    const Writer w{big_endian};
    const Recording r = read_mat5(w.file(w.variable(6, {3, 1}, "x", w.element(9, w.bytes<double>({1.5, -2, 3e300}))) + w.variable(6, {1, 2}, "n", w.small_element(3, w.bytes<std::int16_t>({-300, 7}))) +
                                         w.variable(7, {2, 2}, "m", w.element(7, w.bytes<float>({1, 2, 3, 4}))) + w.variable(14, {1, 1}, "i", w.element(12, w.bytes<std::int64_t>({-5})))),
                                  "f.mat");
    ASSERT_THAT(r.channels, SizeIs(5));
    EXPECT_EQ(r.channels[0].value, (Values{1.5, -2, 3e300}));
    EXPECT_EQ(r.channels[1].value, (Values{-300, 7}));
    EXPECT_THAT(r.channels[1].raw, IsEmpty()) << "their class is double";
    EXPECT_EQ(r.channels[3].name, "m(:,2)");
    EXPECT_EQ(r.channels[3].value, (Values{3, 4}));
    EXPECT_EQ(r.channels[4].value, (Values{-5}));
    EXPECT_THAT(r.channels[4].raw, HasSubstr("integers"));
    EXPECT_THAT(r.warnings, IsEmpty());
  }
}

TEST(Mat5, NamesTheFieldsOfArraysOfStructures) {
  const Writer w;
  const auto number = [&](double x) { return w.variable(6, {1, 1}, "", w.element(9, w.bytes<double>({x}))); };
  const std::string fields = w.small_element(5, w.bytes<std::int32_t>({2})) + w.small_element(1, std::string("a\0b\0", 4));
  const Recording r = read_mat5(w.file(w.variable(2, {1, 2}, "s", fields + number(1) + number(2) + number(3) + w.element(14, ""))), "f.mat");
  ASSERT_THAT(r.channels, SizeIs(3));
  EXPECT_EQ(r.channels[0].name, "s(1).a");
  EXPECT_EQ(r.channels[1].name, "s(1).b");
  EXPECT_EQ(r.channels[2].name, "s(2).a");
  EXPECT_EQ(r.channels[2].value, (Values{3}));
  EXPECT_THAT(r.warnings, ElementsAre(HasSubstr("s(2).b is left out: it is empty")));
}

TEST(Mat5, LeavesOutWhatIsNoRealNumberAndWhatItCannotHold) {
  const Writer w;
  const std::string one = w.element(9, w.bytes<double>({1})), good = w.variable(6, {1, 1}, "x", one);
  const std::vector<std::pair<std::string, std::string>> left_out{
      {w.variable(6 | 0x800, {1, 1}, "v", one + one), "complex"},
      {w.variable(4, {1, 1}, "v", w.small_element(4, "a")), "no numbers"},
      {w.variable(6, {1, 1, 1}, "v", one), "no vector or matrix"},
      {w.variable(6, {0, 3}, "v", w.element(9, "")), "empty"},
      {w.variable(6, {-1, 3}, "v", one), "negative"},
      {w.variable(6, {2, 1}, "v", one), "cut off"},
      {w.variable(6, {2000000000, 2000000000}, "v", one), "cut off"},
      {w.variable(2, {1, 1}, "v", ""), "ends early"},
      {w.variable(2, {30000, 30000}, "v", one), "more than 10000 structures"},
      {w.variable(2, {1, 1}, "v", w.small_element(5, w.bytes<std::int32_t>({-8})) + w.small_element(1, "ab")), "no names"},
      {w.element(15, "no zlib stream"), "damaged"},
      {w.bytes<std::uint32_t>({14, 4000000000u}), "ends early"}};
  for (const auto& [element, why] : left_out) {
    const Recording r = read_mat5(w.file(good + element), "f.mat");
    EXPECT_THAT(r.channels, SizeIs(1)) << why;
    EXPECT_THAT(r.warnings, ElementsAre(HasSubstr(why))) << why;
    EXPECT_THROW(read_mat5(w.file(element), "f.mat"), InputError) << why;
  }
  EXPECT_THROW(read_mat5(w.file(""), "f.mat"), InputError);
  EXPECT_THROW(read_mat5("MATLAB 5.0", "f.mat"), InputError);
}

}  // namespace
}  // namespace unrig
