// TDMS: layouts, byte orders, fragments, cut files; scales; and that unscaled readings are never handed on as physical values.

#include "core/import/tdms.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <string_view>

#include <fmt/format.h>

#include "core/files/error.h"
#include "tests/support/tdms_writer.h"

namespace unrig {
namespace {

using namespace test;  // NOLINT: the writer's many words
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using Values = std::vector<double>;

constexpr std::uint32_t f64 = 10, f32 = 9, i16 = 2, i32 = 3;

const std::vector<TdmsProperty> timing{{"wf_increment", 0.002}, {"wf_start_offset", 0.5}, {"unit_string", std::string("V")}};

TEST(Tdms, ReadsContiguousChunksOfSeveralTypes) {
  const std::string data = values<double>({1, 2}) + values<float>({0.5f, -0.5f});
  const Recording r = read_tdms(tdms_segment(toc_new, {{"/", no_data()}, {"/'G'", no_data()}, {"/'G'/'a'", plain_data(f64, 2), timing}, {"/'G'/'it''s'", plain_data(f32, 2)}}, data + data), "f");
  ASSERT_EQ(r.channels.size(), 2u);
  EXPECT_EQ(r.channels[0].name, "G/a");
  EXPECT_EQ(r.channels[0].value, (Values{1, 2, 1, 2}));
  EXPECT_EQ(r.channels[0].unit, "V");
  EXPECT_EQ(r.channels[0].step, 0.002);
  EXPECT_EQ(r.channels[0].start, 0.5);
  EXPECT_EQ(r.channels[1].name, "G/it's");
  EXPECT_EQ(r.channels[1].value, (Values{0.5, -0.5, 0.5, -0.5}));
  EXPECT_THAT(r.warnings, IsEmpty());
}

TEST(Tdms, ReadsInterleavedAndBigEndianData) {
  for (const bool big : {false, true}) {
    const std::string rows = values<double>({1}, big) + values<float>({10}, big) + values<double>({2}, big) + values<float>({20}, big);
    const std::uint32_t toc = toc_new | toc_interleaved | (big ? toc_big : 0u);
    const Recording r = read_tdms(tdms_segment(toc, {{"/'G'/'a'", plain_data(f64, 2, big)}, {"/'G'/'b'", plain_data(f32, 2, big)}}, rows), "f");
    EXPECT_EQ(r.channels[0].value, (Values{1, 2})) << big;
    EXPECT_EQ(r.channels[1].value, (Values{10, 20})) << big;
  }
}

TEST(Tdms, FollowsFragmentsThatTakeOverTheObjectsBefore) {
  const std::string bytes = tdms_segment(toc_new, {{"/'G'/'a'", plain_data(f64, 2)}, {"/'G'/'b'", plain_data(f64, 1)}}, values<double>({1, 2, 10})) +
                            tdms_segment(0, {}, values<double>({3, 4, 11})) +                                          // everything as before
                            tdms_segment(0, {{"/'G'/'a'", plain_data(f64, 1)}}, values<double>({5, 12})) +             // another length
                            tdms_segment(toc_new, {{"/'G'/'b'", same_data()}}, values<double>({13}));                 // one channel less
  const Recording r = read_tdms(bytes, "f");
  EXPECT_EQ(r.channels[0].value, (Values{1, 2, 3, 4, 5}));
  EXPECT_EQ(r.channels[1].value, (Values{10, 11, 12, 13}));
}

/// Bytes as a description prints them: pairs of hexadecimal digits, spaces ignored.
std::string bytes_of(std::string_view hexadecimal) {
  std::string bytes, digits;
  for (const char c : hexadecimal) {
    if (c == ' ') continue;
    digits += c;
    if (digits.size() == 2) bytes += static_cast<char>(std::stoi(digits, nullptr, 16)), digits.clear();
  }
  return bytes;
}

/// The file that NI's description builds up in six writing iterations ("TDMS File Format Internal Structure", section Optimization, incremental meta information), byte by byte as printed there: chunks
/// that are appended, a property that changes, a channel that comes in, one that grows and then stops.
TEST(Tdms, ReadsTheFileOfNisOwnDescription) {
  const std::string lead = "54 44 53 6D", path_1 = "13 00 00 00 2F 27 67 72 6F 75 70 27 2F 27 63 68 61 6E 6E 65 6C 31 27", path_2 = "13 00 00 00 2F 27 67 72 6F 75 70 27 2F 27 63 68 61 6E 6E 65 6C 32 27",
                    path_3 = "12 00 00 00 2F 27 67 72 6F 75 70 27 2F 27 76 6F 6C 74 61 67 65 27", raw_1 = "01 00 00 00 02 00 00 00 03 00 00 00", raw_2 = "04 00 00 00 05 00 00 00 06 00 00 00",
                    raw_3 = "07 00 00 00 08 00 00 00 09 00 00 00 0A 00 00 00 0B 00 00 00";
  std::string counted;
  for (int k = 1; k <= 27; ++k) counted += fmt::format("{:02X} 00 00 00 ", k);
  const std::string file = lead + "0E 00 00 00 69 12 00 00 A7 00 00 00 00 00 00 00 77 00 00 00 00 00 00 00" + "02 00 00 00" + path_1 +
                           "14 00 00 00 03 00 00 00 01 00 00 00 03 00 00 00 00 00 00 00 01 00 00 00 04 00 00 00 70 72 6F 70 20 00 00 00 05 00 00 00 76 61 6C 69 64" + path_2 +
                           "14 00 00 00 03 00 00 00 01 00 00 00 03 00 00 00 00 00 00 00 00 00 00 00" + raw_1 + raw_2 + raw_1 + raw_2 +  //
                           lead + "0A 00 00 00 69 12 00 00 50 00 00 00 00 00 00 00 38 00 00 00 00 00 00 00" + "01 00 00 00" + path_1 +
                           "00 00 00 00 01 00 00 00 04 00 00 00 70 72 6F 70 20 00 00 00 05 00 00 00 65 72 72 6F 72" + raw_1 + raw_2 +  //
                           lead + "0A 00 00 00 69 12 00 00 5E 00 00 00 00 00 00 00 32 00 00 00 00 00 00 00" + "01 00 00 00" + path_3 +
                           "14 00 00 00 03 00 00 00 01 00 00 00 05 00 00 00 00 00 00 00 00 00 00 00" + raw_1 + raw_2 + raw_3 +  //
                           lead + "0A 00 00 00 69 12 00 00 BF 00 00 00 00 00 00 00 33 00 00 00 00 00 00 00" + "01 00 00 00" + path_2 +
                           "14 00 00 00 03 00 00 00 01 00 00 00 1B 00 00 00 00 00 00 00 00 00 00 00" + raw_1 + counted + raw_3 +  //
                           lead + "0E 00 00 00 69 12 00 00 61 00 00 00 00 00 00 00 41 00 00 00 00 00 00 00" + "02 00 00 00" + path_1 + "00 00 00 00 00 00 00 00" + path_3 + "00 00 00 00 00 00 00 00" +
                           raw_1 + raw_3;
  const Recording r = read_tdms(bytes_of(file), "f");
  Values one, two, voltage;
  for (int k = 0; k < 6; ++k) one.insert(one.end(), {1, 2, 3});
  for (int k = 0; k < 4; ++k) two.insert(two.end(), {4, 5, 6});
  for (int k = 1; k <= 27; ++k) two.push_back(k);
  for (int k = 0; k < 3; ++k) voltage.insert(voltage.end(), {7, 8, 9, 10, 11});
  ASSERT_EQ(r.channels.size(), 3u);
  EXPECT_EQ(r.channels[0].name, "group/channel1");
  EXPECT_EQ(r.channels[0].value, one);
  EXPECT_EQ(r.channels[1].value, two);
  EXPECT_EQ(r.channels[2].name, "group/voltage");
  EXPECT_EQ(r.channels[2].value, voltage);
}

TEST(Tdms, KeepsWhatIsWholeInACutFile) {
  const std::vector<TdmsObject> one{{"/'G'/'a'", plain_data(f64, 4)}}, two{{"/'G'/'a'", plain_data(f64, 2)}, {"/'G'/'b'", plain_data(f64, 2)}};
  const auto cut = [](std::string bytes, std::size_t by) { return bytes.substr(0, bytes.size() - by); };
  const Recording alone = read_tdms(cut(tdms_segment(toc_new, one, values<double>({1, 2, 3, 4})), 11), "f");
  EXPECT_EQ(alone.channels[0].value, (Values{1, 2}));
  EXPECT_FALSE(alone.warnings.empty());
  const Recording rows = read_tdms(cut(tdms_segment(toc_new | toc_interleaved, two, values<double>({1, 10, 2, 20})), 8), "f");
  EXPECT_EQ(rows.channels[0].value, (Values{1}));
  EXPECT_EQ(rows.channels[1].value, (Values{10}));
  // Contiguous: the second chunk breaks off, and its first channel must not become longer than the second.
  const Recording chunks = read_tdms(cut(tdms_segment(toc_new, two, values<double>({1, 2, 10, 20, 3, 4, 30, 40})), 8), "f");
  EXPECT_EQ(chunks.channels[0].value, (Values{1, 2}));
  EXPECT_EQ(chunks.channels[1].value, (Values{10, 20}));
  // A crash of LabVIEW leaves the length of the last segment open.
  std::string open = tdms_segment(toc_new, one, values<double>({1, 2, 3, 4}));
  for (std::size_t i = 12; i < 20; ++i) open[i] = '\xFF';
  EXPECT_EQ(read_tdms(open, "f").channels[0].value, (Values{1, 2, 3, 4}));
}

/// Two channels of 16 bits in one row of four bytes, as a DAQmx task writes them.
std::string daqmx(const std::vector<TdmsProperty>& first, const std::vector<TdmsProperty>& second) {
  return tdms_segment(toc_new | toc_daqmx, {{"/'G'/'a'", daqmx_data(3, {{3, 0, 0, 0}}, {4}), first}, {"/'G'/'b'", daqmx_data(3, {{3, 0, 2, 0}}, {4}), second}},
                      values<std::int16_t>({100, -1, 200, -2, 300, -3}));
}

TEST(Tdms, ScalesDaqmxReadingsByTheirChain) {
  const std::vector<TdmsProperty> linear{{"NI_Scaling_Status", std::string("unscaled")}, {"NI_Number_Of_Scales", std::int32_t(2)}, {"NI_Scale[1]_Scale_Type", std::string("Linear")},
                                         {"NI_Scale[1]_Linear_Slope", 0.01},             {"NI_Scale[1]_Linear_Y_Intercept", 5.0},  {"NI_Scale[1]_Linear_Input_Source", std::int32_t(0)}};
  const Recording r = read_tdms(daqmx(linear, {}), "f");
  EXPECT_THAT(r.channels[0].raw, IsEmpty());
  EXPECT_THAT(r.channels[0].value, ElementsAre(6, 7, 8));
  EXPECT_THAT(r.channels[1].raw, HasSubstr("no scale"));  // npTDMS issues 228, 120, 74, 82: never as if it were scaled
  EXPECT_EQ(r.channels[1].value, (Values{-1, -2, -3}));
}

TEST(Tdms, MarksWhatItCannotScale) {
  const auto unscaled = [](std::vector<TdmsProperty> properties) {
    return read_tdms(tdms_segment(toc_new, {{"/'G'/'a'", plain_data(f64, 1), properties}}, values<double>({1})), "f").channels[0].raw;
  };
  const TdmsProperty one_scale{"NI_Number_Of_Scales", std::int32_t(1)};
  EXPECT_THAT(unscaled({}), IsEmpty());  // a float without a word about scales is what the program that wrote it meant
  EXPECT_THAT(unscaled({{"NI_Scaling_Status", std::string("unscaled")}}), HasSubstr("no scale"));
  EXPECT_THAT(unscaled({one_scale, {"NI_Scale[0]_Scale_Type", std::string("Thermistor")}}), HasSubstr("Thermistor"));
  EXPECT_THAT(unscaled({one_scale, {"NI_Scale[0]_Scale_Type", std::string("Linear")}}), HasSubstr("Linear_Slope is missing"));
  EXPECT_THAT(unscaled({one_scale, {"NI_Scale[0]_Scale_Type", std::string("Linear")}, {"NI_Scale[0]_Linear_Slope", 1.0}, {"NI_Scale[0]_Linear_Y_Intercept", 0.0}, {"NI_Scale[0]_Linear_Input_Source", std::int32_t(0)}}),
              HasSubstr("circle"));
  EXPECT_THAT(read_tdms(tdms_segment(toc_new, {{"/'G'/'a'", plain_data(i16, 1)}}, values<std::int16_t>({1})), "f").channels[0].raw, HasSubstr("no scale"));
  // A scale of the group holds for its channels.
  const Recording group = read_tdms(tdms_segment(toc_new, {{"/'G'", no_data(), {one_scale, {"NI_Scale[0]_Scale_Type", std::string("Linear")}, {"NI_Scale[0]_Linear_Slope", 2.0}, {"NI_Scale[0]_Linear_Y_Intercept", 10.0}}},
                                                           {"/'G'/'a'", plain_data(i32, 2)}}, values<std::int32_t>({1, 2})), "f");
  EXPECT_EQ(group.channels[0].value, (Values{12, 14}));
}

TEST(Tdms, AppliesEachKindOfScale) {
  const auto scaled = [](std::vector<TdmsProperty> properties, double x) {
    const Recording r = read_tdms(tdms_segment(toc_new, {{"/'G'/'a'", plain_data(f64, 1), properties}}, values<double>({x})), "f");
    EXPECT_THAT(r.channels[0].raw, IsEmpty());
    return r.channels[0].value[0];
  };
  const auto property = [](int i, const std::string& name, std::variant<double, std::int32_t, std::string> value) { return TdmsProperty{"NI_Scale[" + std::to_string(i) + "]_" + name, value}; };
  const TdmsProperty one{"NI_Number_Of_Scales", std::int32_t(1)}, three{"NI_Number_Of_Scales", std::int32_t(3)};
  EXPECT_DOUBLE_EQ(scaled({one, property(0, "Scale_Type", std::string("Polynomial")), property(0, "Polynomial_Coefficients_Size", std::int32_t(3)), property(0, "Polynomial_Coefficients[0]", 1.0),
                           property(0, "Polynomial_Coefficients[1]", 2.0), property(0, "Polynomial_Coefficients[2]", 3.0)}, 2), 17);
  EXPECT_DOUBLE_EQ(scaled({one, property(0, "Scale_Type", std::string("Table")), property(0, "Table_Scaled_Values_Size", std::int32_t(2)), property(0, "Table_Scaled_Values[0]", 0.0),
                           property(0, "Table_Scaled_Values[1]", 2.0), property(0, "Table_Pre_Scaled_Values_Size", std::int32_t(2)), property(0, "Table_Pre_Scaled_Values[0]", 10.0),
                           property(0, "Table_Pre_Scaled_Values[1]", 20.0)}, 0.5), 12.5);
  // (2 x) + (x + 1): scales 0 and 1 from the reading, 2 from both.
  EXPECT_DOUBLE_EQ(scaled({three, property(0, "Scale_Type", std::string("Linear")), property(0, "Linear_Slope", 2.0), property(0, "Linear_Y_Intercept", 0.0),
                           property(1, "Scale_Type", std::string("Linear")), property(1, "Linear_Slope", 1.0), property(1, "Linear_Y_Intercept", 1.0), property(2, "Scale_Type", std::string("Add")),
                           property(2, "Add_Left_Operand_Input_Source", std::int32_t(0)), property(2, "Add_Right_Operand_Input_Source", std::int32_t(1))}, 5), 16);
  // (x + 1) - 2 x: "LabVIEW subtracts the left operand from the right one" (npTDMS, SubtractScaling, as observed in LabVIEW).
  EXPECT_DOUBLE_EQ(scaled({three, property(0, "Scale_Type", std::string("Linear")), property(0, "Linear_Slope", 2.0), property(0, "Linear_Y_Intercept", 0.0),
                           property(1, "Scale_Type", std::string("Linear")), property(1, "Linear_Slope", 1.0), property(1, "Linear_Y_Intercept", 1.0), property(2, "Scale_Type", std::string("Subtract")),
                           property(2, "Subtract_Left_Operand_Input_Source", std::int32_t(0)), property(2, "Subtract_Right_Operand_Input_Source", std::int32_t(1))}, 5), -4);
  // A quarter bridge: -4 V / (GF (1 + 2 V)) with V = 6.8827 mV / 2.5 V, by hand.
  EXPECT_NEAR(scaled({one, property(0, "Scale_Type", std::string("Strain")), property(0, "Strain_Configuration", std::int32_t(10271)), property(0, "Strain_Gage_Factor", 2.1),
                      property(0, "Strain_Voltage_Excitation", 2.5)}, 0.0068827), -5.215246e-3, 5e-10);
}

TEST(Tdms, RefusesWhatContradictsItself) {
  const std::string good = tdms_segment(toc_new, {{"/'G'/'a'", plain_data(f64, 2)}}, values<double>({1, 2}));
  const auto complaint = [](const std::string& bytes) -> std::string {
    try {
      read_tdms(bytes, "f.tdms");
    } catch (const InputError& e) {
      return e.what();
    }
    return "nothing";
  };
  EXPECT_THAT(complaint(""), HasSubstr("empty"));
  EXPECT_THAT(complaint("TDSx" + good.substr(4)), HasSubstr("TDSm"));
  EXPECT_THAT(complaint(good.substr(0, 20)), HasSubstr("ends early"));
  EXPECT_THAT(complaint(tdms_segment(toc_new, {{"/'G'/'a'", plain_data(f64, 1u << 30)}}, values<double>({1}))), HasSubstr("counts"));
  EXPECT_THAT(complaint(tdms_segment(toc_new, {{"/'G'/'a'", plain_data(77, 1)}}, values<double>({1}))), HasSubstr("unknown type"));
  EXPECT_THAT(complaint(tdms_segment(toc_new | toc_daqmx, {{"/'G'/'a'", daqmx_data(1, {{3, 0, 3, 0}}, {4})}}, values<std::int16_t>({1, 2}))), HasSubstr("outside of its row"));
  EXPECT_THAT(complaint(good + "garbage at the end of the file, longer than a lead-in"), HasSubstr("no segment begins here"));
}

}  // namespace
}  // namespace unrig
