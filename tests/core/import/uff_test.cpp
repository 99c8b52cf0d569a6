// Universal files: text and binary, both precisions, even and uneven, and what is malformed.

#include "core/import/uff.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fmt/format.h>

#include "core/files/error.h"
#include "tests/support/tdms_writer.h"

namespace unrig {
namespace {

using ::testing::HasSubstr;
using test::TdmsBytes;
using Values = std::vector<double>;

std::string records(int type, std::size_t points, int even, const std::string& kind, int node = 3, int direction = 3) {
  std::string text = fmt::format("{:>6}\n{}\nGauge\nNONE\n21-Nov-26\nNONE\nNONE\n", -1, kind);
  text += fmt::format("{:5}{:10}{:5}{:10} {:10}{:10}{:4} {:10}{:10}{:4}\n", 1, 0, 1, 0, "RIG", node, direction, "NONE", 0, 0);
  text += fmt::format("{:10}{:10}{:10}{:13.5E}{:13.5E}{:13.5E}\n", type, points, even, 0.5, 0.002, 0.0);
  for (const char* unit : {"s", "V", "NONE", "NONE"}) text += fmt::format("{:10}{:5}{:5}{:5} {:<20} {:<20}\n", 17, 0, 0, 0, "label", unit);
  return text;
}

std::string text_58(int type, int even, const Values& x, const Values& y, const std::string& kind = "    58") {
  std::string out = records(type, y.size(), even, kind);
  const int per_line = even ? (type == 4 ? 4 : 6) : (type == 4 ? 2 : 3);
  for (std::size_t k = 0; k < y.size(); ++k) {
    if (!even) out += fmt::format("{:13.5E}", x[k]);
    out += type == 4 ? fmt::format("{:20.12E}", y[k]) : fmt::format("{:13.5E}", y[k]);
    if (static_cast<int>(k) % per_line == per_line - 1 || k + 1 == y.size()) out += "\n";
  }
  return out + "    -1\n";
}

std::string binary_58(int type, int even, bool big, const Values& x, const Values& y, bool single_abscissa = false) {
  TdmsBytes data(big);
  for (std::size_t k = 0; k < y.size(); ++k) {
    const auto put = [&](double v, bool single) { single ? data.number(static_cast<float>(v)) : data.number(v); };
    if (!even) put(x[k], type == 2 || single_abscissa);
    put(y[k], type == 2);
  }
  const std::string kind = fmt::format("    58b{:6}{:6}{:12}{:12}{:6}{:6}{:12}{:12}", big ? 2 : 1, 2, 11, data.bytes().size(), 0, 0, 0, 0);
  return records(type, y.size(), even, kind) + data.bytes() + "\n    -1\n";
}

const Values x{0, 0.125, 0.25, 0.5, 0.75, 1, 1.5}, y{1, -2.5, 3.25e-3, 4e10, -5, 6, 7};

TEST(Uff, ReadsEachLayoutOfRealNumbers) {
  for (const int type : {2, 4})
    for (const int even : {1, 0}) {
      std::vector<std::string> files{text_58(type, even, x, y), binary_58(type, even, false, x, y), binary_58(type, even, true, x, y)};
      if (type == 4 && !even) files.push_back(binary_58(type, even, false, x, y, true));
      for (const std::string& file : files) {
        const Recording r = read_uff(file, "f.uff");
        ASSERT_EQ(r.channels.size(), even ? 1u : 2u);
        const RecordedChannel& channel = r.channels.back();
        EXPECT_EQ(channel.name, "3:+Z");
        EXPECT_EQ(channel.unit, "V");
        EXPECT_EQ(channel.step, even ? 0.002 : 0);
        EXPECT_EQ(channel.start, even ? 0.5 : 0);
        // Single precision: half a unit of the seventh digit; text: five decimals of it.
        for (std::size_t k = 0; k < y.size(); ++k) EXPECT_NEAR(channel.value[k], y[k], 1e-6 * std::abs(y[k]));
        if (!even) {
          EXPECT_EQ(r.channels[0].value, x);  // exact in single precision
        }
      }
    }
}

TEST(Uff, ReadsComplexFunctionsWithWhatTheyAre) {
  const Values f{1, 1.125, 1.25, 1.5, 1.75}, re{1, -2.5, 3.25e-3, 4e10, -5}, im{-1, 2, 0, 1e-3, 8};
  for (const bool is_double : {false, true})
    for (const int even : {1, 0}) {
      const int type = is_double ? 6 : 5;
      std::string text = records(type, f.size(), even, "    58");
      const int per_line = even ? (is_double ? 2 : 3) : (is_double ? 1 : 2);  // points
      for (std::size_t k = 0; k < f.size(); ++k) {
        if (!even) text += fmt::format("{:13.5E}", f[k]);
        for (const double v : {re[k], im[k]}) text += is_double ? fmt::format("{:20.12E}", v) : fmt::format("{:13.5E}", v);
        if (static_cast<int>(k) % per_line == per_line - 1 || k + 1 == f.size()) text += "\n";
      }
      std::vector<std::string> files{text + "    -1\n"};
      for (const bool big : {false, true}) {
        TdmsBytes data(big);
        const auto put = [&](double v) { is_double ? data.number(v) : data.number(static_cast<float>(v)); };
        for (std::size_t k = 0; k < f.size(); ++k) {
          if (!even) put(f[k]);
          put(re[k]);
          put(im[k]);
        }
        files.push_back(records(type, f.size(), even, fmt::format("    58b{:6}{:6}{:12}{:12}{:6}{:6}{:12}{:12}", big ? 2 : 1, 2, 11, data.bytes().size(), 0, 0, 0, 0)) + data.bytes() + "\n    -1\n");
      }
      for (std::string file : files) {
        // A frequency response function, struck at 12:-Y.
        const std::string entity = fmt::format("{:5}{:10}{:5}{:10} {:10}{:10}{:4} {:10}{:10}{:4}", 1, 0, 1, 0, "RIG", 3, 3, "NONE", 0, 0), struck = fmt::format("{:5}{:10}{:5}{:10} {:10}{:10}{:4} {:10}{:10}{:4}", 4, 0, 1, 0, "RIG", 3, 3, "NONE", 12, -2);
        file.replace(file.find(entity), entity.size(), struck);
        const std::vector<UffFunction> functions = read_uff_functions(file, "f.uff");
        ASSERT_EQ(functions.size(), 1u);
        const UffFunction& found = functions[0];
        EXPECT_EQ(found.type, 4);
        EXPECT_EQ(found.node, 3);
        EXPECT_EQ(found.direction, 3);
        EXPECT_EQ(found.reference_node, 12);
        EXPECT_EQ(found.reference_direction, -2);
        EXPECT_EQ(found.unit, "V");
        ASSERT_EQ(found.value.size(), f.size());
        for (std::size_t k = 0; k < f.size(); ++k) {
          EXPECT_NEAR(found.value[k].real(), re[k], 1e-6 * std::abs(re[k]));
          EXPECT_NEAR(found.value[k].imag(), im[k], 1e-6 * std::abs(im[k]));
          EXPECT_NEAR(found.abscissa[k], even ? 0.5 + 0.002 * static_cast<double>(k) : f[k], 1e-12);
        }
        try {
          read_uff(file, "f.uff");
          FAIL() << "it holds no recording";
        } catch (const InputError& e) {
          EXPECT_THAT(e.what(), HasSubstr("new rig --from impact-test"));
        }
      }
    }
}

TEST(Uff, SkipsOtherDatasetsAndTellsRepeatedNamesApart) {
  const std::string units = "    -1\n   164\n  1  SI\n  1.0\n    -1\n";
  const Recording r = read_uff(units + text_58(2, 1, {}, y) + text_58(2, 1, {}, y), "f");
  ASSERT_EQ(r.channels.size(), 2u);
  EXPECT_EQ(r.channels[1].name, "3:+Z#2");
}

/// The layout of an amplifier's own software (HBM catman): every line filled up to 80 columns, exponents of three digits, nodes that are all 0, so that only the labels tell channels apart.
TEST(Uff, ReadsTheLayoutOfAnAmplifiersSoftware) {
  const auto dataset = [](const std::string& label, const std::string& carriage_return) {
    std::string text;
    for (const std::string& line : {std::string("    -1"), std::string("    58"), label + " : V", std::string("UFF58 file"), std::string("21-Nov-26 10:00:00"), std::string("NONE"), std::string("NONE"),
                                    std::string("    1         0    0         0 NONE               0   0 NONE               0   0"),
                                    std::string("         2         7         1 0.00000E+000 5.00000E-005 0.00000E+000"), std::string("        17    0    0    0 Time                 s"),
                                    fmt::format("         1    0    0    0 {:<20} m/s\xB2", label), std::string("         0    0    0    0 NONE                 NONE"),
                                    std::string("         0    0    0    0 NONE                 NONE"),
                                    std::string("  1.00000E+00 -2.00000E+00  3.00000E-03  4.00000E+10 -5.00000E+00  6.00000E+00"), std::string("  7.00000E+00"), std::string("    -1")})
      text += fmt::format("{:<80}{}\n", line, carriage_return);
    return text;
  };
  for (const char* carriage_return : {"", "\r"}) {
    const Recording r = read_uff(dataset("Bridge", carriage_return) + dataset("Angle", carriage_return) + dataset("NONE", carriage_return), "f");
    ASSERT_EQ(r.channels.size(), 3u);
    EXPECT_EQ(r.channels[0].name, "Bridge");
    EXPECT_EQ(r.channels[0].unit, "m/s\xC2\xB2") << "out of Latin-1";
    EXPECT_EQ(r.channels[0].step, 5e-5);
    EXPECT_EQ(r.channels[0].value, (Values{1, -2, 3e-3, 4e10, -5, 6, 7}));
    EXPECT_EQ(r.channels[1].name, "Angle");
    EXPECT_EQ(r.channels[2].name, "NONE : V") << "its first line is all there is";
  }
}

TEST(Uff, RefusesWhatIsCutOffOrNotAsItSays) {
  const auto complaint = [](const std::string& bytes) -> std::string {
    try {
      read_uff(bytes, "f.uff");
    } catch (const InputError& e) {
      return e.what();
    }
    return "nothing";
  };
  const std::string text = text_58(2, 1, {}, y), binary = binary_58(4, 1, false, {}, y);
  EXPECT_THAT(complaint(""), HasSubstr("no dataset 58"));
  EXPECT_THAT(complaint(text.substr(0, text.rfind("-1") - 5 - 13)), HasSubstr("ends within"));
  EXPECT_THAT(complaint(binary.substr(0, binary.size() - 20)), HasSubstr("ends within"));
  std::string more = text, number = text;
  more.replace(more.find("         7         1"), 10, "       900");
  EXPECT_THAT(complaint(more), HasSubstr("points in a file"));
  number.replace(number.find("4.00000E+10"), 4, "four");
  EXPECT_THAT(complaint(number), HasSubstr("is no number"));
  std::string fewer = binary;
  fewer.replace(fewer.find("         7         1"), 10, "         6");
  EXPECT_THAT(complaint(fewer), HasSubstr("do not make"));
}

TEST(Uff, LeavesOutComplexFunctionsWithAWarning) {
  std::string complex = text_58(2, 1, {}, {1, 2, 3, 4});
  complex.replace(complex.find("         2         4"), 20, "         5         2");
  const Recording r = read_uff(complex + text_58(2, 1, {}, y), "f");
  ASSERT_EQ(r.channels.size(), 1u);
  ASSERT_EQ(r.warnings.size(), 1u);
  EXPECT_THAT(r.warnings[0], HasSubstr("complex"));
}

}  // namespace
}  // namespace unrig
