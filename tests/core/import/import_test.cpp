// The mapping from a laboratory's file to a run file, text tables, LabVIEW's, and MATLAB files written by libmatio and h5py.

#include "core/import/import.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <matio.h>

#include <cmath>
#include <cstring>
#include <map>
#include <tuple>

#include "core/files/error.h"
#include "core/import/channel_list.h"
#include "core/import/delimited.h"
#include "core/import/import_template.h"
#include "core/import/lvm.h"
#include "core/run/run.h"
#include "tests/support/temporary_directory.h"

namespace unrig {
namespace {

using ::testing::AllOf;
using ::testing::Contains;
using ::testing::ContainsRegex;
using ::testing::Each;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;
using test::TemporaryDirectory;
using Values = std::vector<double>;

template <class Call>
std::string complaint(Call call) {
  try {
    call();
  } catch (const InputError& e) {
    return e.what();
  }
  return "nothing";
}

const std::string head = "unrig_import = 1\n[run]\nkind = \"step\"\nmedium = \"water\"\ndensity = \"1 g/cm^3\"\nspeed = \"0.6 m/s\"\ncalibration = \"4.4 N/V\"\n";

Recording recording() {
  Recording r{"lab.tdms", "TDMS", {}, {}};
  r.channels.push_back({"angle", "deg", {0, 1, 2, 3}, "", 0.01, 0});
  r.channels.push_back({"bridge", "mV", {1, 2, std::nan(""), 4}, "", 0.01, 0});
  r.channels.push_back({"counts", "", {10, 20, 30, 40}, "the file gives readings of the converter and no scale", 0.01, 0});
  r.channels.push_back({"clock", "", {0, 10, 20, 30}, "", 0, 0});
  return r;
}

TEST(Import, WritesARunThatReadsBack) {
  const std::string map = head + "[[column]]\nname = \"alpha\"\nsource = \"angle\"\n[[column]]\nname = \"gauge\"\nsource = \"bridge\"\n";
  const Imported imported = import_recording(recording(), map, "map.toml");
  const unrig::Run run = parse_run(imported.text, "run.csv");
  EXPECT_EQ(run.dt, 0.01);
  EXPECT_DOUBLE_EQ(run.density, 1000);
  EXPECT_DOUBLE_EQ(run.channel("alpha").value[3], 3 * std::acos(-1) / 180);
  EXPECT_NEAR(run.channel("gauge").value[3], 4e-3 * 4.4, 1e-15);
  EXPECT_EQ(run.channel("gauge").missing, 1u);
  EXPECT_EQ(imported.samples, 4u);
}

TEST(Import, TakesTheTimeFromAChannelOrARate) {
  const std::string column = "[[column]]\nname = \"gauge\"\nsource = \"bridge\"\n";
  EXPECT_EQ(parse_run(import_recording(recording(), head + "[time]\nsource = \"clock\"\nunit = \"ms\"\n" + column, "m").text, "r").dt, 0.01);
  EXPECT_EQ(parse_run(import_recording(recording(), head + "[time]\nrate = \"200 Hz\"\nstart = \"1 s\"\n" + column, "m").text, "r").start, 1);
  EXPECT_THAT(complaint([&] { import_recording(recording(), head + "[time]\nsource = \"clock\"\n" + column, "m"); }), HasSubstr("no unit"));
  EXPECT_THAT(complaint([&] { import_recording(recording(), head + "[time]\nsource = \"clock\"\nrate = \"1 Hz\"\n" + column, "m"); }), HasSubstr("both or neither"));
  Recording untimed = recording();
  for (RecordedChannel& c : untimed.channels) c.step = 0;
  EXPECT_THAT(complaint([&] { import_recording(untimed, head + column, "m"); }), HasSubstr("no sampling interval"));
}

TEST(Import, NeverTakesUnscaledReadingsForPhysicalValues) {
  const std::string column = "[[column]]\nname = \"gauge\"\nsource = \"counts\"\n";
  std::string map = head + column;
  EXPECT_THAT(complaint([&] { import_recording(recording(), map, "m"); }), HasSubstr("unscaled readings"));
  EXPECT_THAT(complaint([&] { import_recording(recording(), map + "unit = \"V\"\n", "m"); }), HasSubstr("unscaled readings"));
  EXPECT_THAT(complaint([&] { import_recording(recording(), map + "raw = true\nunit = \"V\"\n", "m"); }), HasSubstr("counts have no unit"));
  map.replace(map.find("4.4 N/V"), 7, "0.01 N");
  EXPECT_NEAR(parse_run(import_recording(recording(), map + "raw = true\n", "m").text, "r").channel("gauge").value[3], 0.4, 1e-15);
  EXPECT_THAT(complaint([&] { import_recording(recording(), head + "[[column]]\nname = \"gauge\"\nsource = \"bridge\"\nraw = true\n", "m"); }), HasSubstr("no raw channel"));
}

TEST(Import, ScalesABridgeThatTheMappingDescribes) {
  std::string map = head + "[[column]]\nname = \"gauge\"\nsource = \"bridge\"\nbridge.kind = \"full-1\"\nbridge.gauge_factor = 2.0\nbridge.excitation = \"5 V\"\n";
  map.replace(map.find("4.4 N/V"), 7, "1e6 N");
  EXPECT_NEAR(parse_run(import_recording(recording(), map, "m").text, "r").channel("gauge").value[3], -4e-3 / 5 / 2 * 1e6, 1e-9);
  EXPECT_NEAR(parse_run(import_recording(recording(), map + "bridge.shunt_reading = \"2 mV\"\nbridge.shunt_expected = \"2.2 mV\"\n", "m").text, "r").channel("gauge").value[3], -440, 1e-9);
  EXPECT_THAT(complaint([&] { import_recording(recording(), map + "bridge.shunt_reading = \"2 mV\"\n", "m"); }), HasSubstr("incomplete"));
}

TEST(Import, NamesWhatIsWrongInAMapping) {
  const auto with = [](const std::string& text) { return complaint([&] { import_recording(recording(), text, "map.toml"); }); };
  EXPECT_THAT(with("[run]\n"), HasSubstr("unrig_import = 1"));
  EXPECT_THAT(with(head + "[[column]]\nname = \"gauge\"\nsource = \"brigde\"\n"), HasSubstr("\"bridge\""));
  EXPECT_THAT(with(head + "[[column]]\nname = \"gauge\"\nsource = \"bridge\"\nunit = \"V\"\n"), HasSubstr("\"mV\" in the file"));
  EXPECT_EQ(parse_run(import_recording(recording(), head + "[[column]]\nname = \"gauge\"\nsource = \"bridge\"\nunit = \"millivolt\"\n", "m").text, "r").channel("gauge").value[3],
            parse_run(import_recording(recording(), head + "[[column]]\nname = \"gauge\"\nsource = \"bridge\"\n", "m").text, "r").channel("gauge").value[3])
      << "another name of the same unit";
  EXPECT_THAT(with(head + "[[column]]\nname = \"gauge\"\nsource = \"bridge\"\ncolour = 1\n"), HasSubstr("column[1].colour"));
  EXPECT_THAT(with(head + "[[column]]\nname = \"ga,uge\"\nsource = \"bridge\"\n"), HasSubstr("without comma"));
  Recording uneven = recording();
  uneven.channels[1].value.pop_back();
  EXPECT_THAT(complaint([&] { import_recording(uneven, head + "[[column]]\nname = \"alpha\"\nsource = \"angle\"\n[[column]]\nname = \"gauge\"\nsource = \"bridge\"\n", "m"); }), HasSubstr("3 samples"));
}

TEST(Import, TakesTheGOfAnAccelerometerForGravity) {
  std::string rows = "time (s);Beschl. (g)\n";
  for (int k = 0; k < 30; ++k) rows += std::to_string(k) + ";" + std::to_string(k % 3) + "\n";
  const Recording r = read_delimited(rows, "log.csv");
  const std::string text = import_template(r);
  EXPECT_THAT(text, HasSubstr("name = \"acc\""));
  const Imported imported = import_recording(r, text, "map.toml");
  EXPECT_DOUBLE_EQ(parse_run(imported.text, "run.csv").channel("acc").value[2], 2 * 9.80665);
}

TEST(Import, WarnsOfNamesThatNoCommandReads) {
  const auto warnings = [](const std::string& name, const std::string& also = "") {
    std::string map = head.substr(0, head.find("calibration")) + "[[column]]\nname = \"" + name + "\"\nsource = \"bridge\"\n";  // line 7
    if (!also.empty()) map += "[[column]]\nname = \"" + also + "\"\nsource = \"angle\"\n";
    return import_recording(recording(), map, "map.toml").warnings;
  };
  const auto question = [](const std::string& name) { return HasSubstr("map.toml:8: no command reads the column \"" + name + "\", unless a [[sensor]] of the rig file names it"); };
  const auto neither = HasSubstr("neither a column \"gauge\" nor \"alpha\"");
  for (const auto& [name, meant] : std::vector<std::pair<std::string, std::string>>{{"guage", "gauge"}, {"Gauge", "gauge"}, {"gage", "gauge"}, {"bridge", "gauge"}, {"angle", "alpha"}, {"mount_acceleratoin", "mount_acceleration"}})
    EXPECT_THAT(warnings(name), ElementsAre(AllOf(question(name), HasSubstr("did you mean \"" + meant + "\"?")), neither)) << name;
  EXPECT_THAT(warnings("guage", "alpha"), ElementsAre(question("guage")));
  EXPECT_THAT(warnings("gauge2", "gauge"), Each(Not(HasSubstr("did you mean")))) << "a second one";
  EXPECT_THAT(warnings("heave", "pitch"), ElementsAre(neither));
  EXPECT_THAT(warnings("temperature", "alpha"), IsEmpty());
}

/// Without a table [time] the sampling is the channels' own, and must be one for all.
TEST(Import, TakesChannelsOfOneClockOnly) {
  const std::string map = head.substr(0, head.find("calibration")) + "[[column]]\nname = \"alpha\"\nsource = \"angle\"\n[[column]]\nname = \"gauge\"\nsource = \"bridge\"\n";
  EXPECT_THAT(complaint([&] { import_recording(recording(), map, "map.toml"); }), "nothing");
  Recording faster = recording(), later = recording();
  faster.channels[1].step = 0.02;
  later.channels[1].start = 1;
  for (const Recording& r : {faster, later})
    EXPECT_THAT(complaint([&] { import_recording(r, map, "map.toml"); }), HasSubstr("\"angle\" and \"bridge\" are sampled differently; wanted channels of one clock"));
}

TEST(Import, FindsAChannelByWhatTheFileCallsItElsewhere) {
  Recording r = recording();
  r.channels[1].label = "load cell";
  const std::string map = head + "[time]\nrate = \"100 Hz\"\n[[column]]\nname = \"gauge\"\nsource = \"load cell\"\n[[column]]\nname = \"alpha\"\nsource = \"angle\"\n";
  EXPECT_THAT(import_recording(r, map, "map.toml").columns, Contains(HasSubstr("gauge [mV] from bridge")));
  r.channels[2].label = "load cell";
  EXPECT_THAT(complaint([&] { import_recording(r, map, "map.toml"); }), HasSubstr("holds no channel \"load cell\"")) << "two of them";
}

TEST(Import, ListsRangeMeanAndNoise) {
  Recording r{"lab.tdms", "TDMS", {}, {}};
  RecordedChannel force{"G/Force", "N", {}, "", 0.002, 0};
  for (int k = 0; k < 4000; ++k) force.value.push_back(10 + (k % 2 == 0 ? 0.5 : -0.5) * std::sqrt(12.0) * std::fmod(k * 0.6180339887498949, 1.0));  // no signal of its own that is slow
  force.value[7] = std::nan("");
  r.channels = {force, {"Clock", "ms", {}, "", 0, 0}, {"counts", "", {5, 5, 5}, "no scale", 0, 0}};
  for (int k = 0; k < 100; ++k) r.channels[1].value.push_back(4 * k);
  const std::string list = channel_list(r);
  EXPECT_THAT(list, HasSubstr("lab.tdms: TDMS, 3 channels"));
  EXPECT_THAT(list, ContainsRegex("G/Force +4000 +N +500 Hz +8\\.[0-9]+ +11\\.[0-9]+ +(9\\.9|10)[0-9.]* +[0-9.]+  1 missing"));
  EXPECT_THAT(list, ContainsRegex("Clock +100 +ms +250 Hz +0 +396 +198 +-"));
  EXPECT_THAT(list, ContainsRegex("counts +3 +- +250 Hz +5 +5 +5 +0  UNSCALED: no scale"));
}

TEST(Import, SaysWhatToDoWithAWorkbook) {
  const TemporaryDirectory directory;
  for (const std::string& begin : {std::string("PK\x03\x04\x14\0\x06\0", 8), std::string("\xD0\xCF\x11\xE0\xA1\xB1", 6)})
    EXPECT_THAT(complaint([&] { read_recording(directory.file("run.xlsx", begin), "unrig_import = 1\n", "map.toml"); }), AllOf(HasSubstr("run.xlsx: this is an Excel workbook"), HasSubstr("Export the sheet as CSV")));
}

// ------------------------------------------------------------------------------------------------------ LabVIEW measurement files

const std::string lvm_head = "LabVIEW Measurement\t\nWriter_Version\t2\nReader_Version\t2\nSeparator\tTab\nDecimal_Separator\t.\nMulti_Headings\tNo\nX_Columns\tNo\nTime_Pref\tAbsolute\n"
                             "Date\t2026/11/23\nTime\t12:00:00,5\n***End_of_Header***\t\n\t\nChannels\t2\t\t\nSamples\t4\t4\t\nDate\t2026/11/23\t2026/11/23\t\nY_Unit_Label\tdeg\tVolts\t\n"
                             "X_Dimension\tTime\tTime\t\nX0\t0.5\t0.5\t\nDelta_X\t0.002000\t0.002000\t\n***End_of_Header***\t\t\t\n";
const std::string lvm_table = "X_Value\tAngle\tBridge\tComment\n\t1.5\t0.25\tbegin\n\t2.5\t0.5\n\t3.5\t0.75\n\t4.5\t1\n";

TEST(Lvm, ReadsUnitsAndSamplingFromItsHeaders) {
  const Recording r = read_lvm(lvm_head + lvm_table, "f.lvm");
  ASSERT_EQ(r.channels.size(), 2u);
  EXPECT_EQ(r.channels[0].name, "Angle");
  EXPECT_EQ(r.channels[0].unit, "deg");
  EXPECT_EQ(r.channels[0].value, (Values{1.5, 2.5, 3.5, 4.5}));
  EXPECT_EQ(r.channels[1].unit, "Volts");
  EXPECT_EQ(r.channels[1].value, (Values{0.25, 0.5, 0.75, 1}));
  EXPECT_EQ(r.channels[1].step, 0.002);
  EXPECT_EQ(r.channels[1].start, 0.5);
}

TEST(Lvm, ReadsItsOtherForms) {
  const auto with = [](std::string text, const std::vector<std::pair<std::string, std::string>>& changes) {
    for (const auto& [what, by] : changes)
      for (std::size_t at = 0; (at = text.find(what, at)) != std::string::npos; at += by.size()) text.replace(at, what.size(), by);
    return text;
  };
  const std::string timed = with(lvm_head, {{"X_Columns\tNo", "X_Columns\tOne"}}) + "X_Value\tAngle\tBridge\tComment\n0.500\t1.5\t0.25\n0.502\t2.5\t0.5\n0.504\t3.5\t0.75\n";
  const Recording one = read_lvm(timed, "f.lvm");
  ASSERT_EQ(one.channels.size(), 3u);
  EXPECT_EQ(one.channels[0].unit, "s");
  EXPECT_EQ(one.channels[1].unit, "deg");
  EXPECT_EQ(one.channels[1].step, 0.002);
  EXPECT_EQ(read_lvm(with(timed, {{"0.504", "0.604"}}), "f.lvm").channels[1].step, 0) << "the column of times is not that of Delta_X";

  const Recording german = read_lvm(with(with(lvm_head, {{"Decimal_Separator\t.", "Decimal_Separator\t,"}, {"0.002000", "0,002000"}, {"0.5\t", "0,5\t"}}) + with(lvm_table, {{".", ","}}), {{"\n", "\r\n"}}), "f.lvm");
  EXPECT_EQ(german.channels[1].value, (Values{0.25, 0.5, 0.75, 1}));
  EXPECT_EQ(german.channels[1].step, 0.002);

  const Recording commas = read_lvm(with(lvm_head + lvm_table, {{"Separator\tTab", "Separator\tComma"}, {"12:00:00,5", "12:00:00"}, {"\t", ","}}), "f.lvm");
  EXPECT_EQ(commas.channels[1].value, (Values{0.25, 0.5, 0.75, 1}));

  const Recording several = read_lvm(lvm_head + lvm_table + "\n" + lvm_head.substr(lvm_head.find("Channels")) + lvm_table, "f.lvm");
  EXPECT_EQ(several.channels[1].value.size(), 4u);
  EXPECT_THAT(several.warnings, ElementsAre(HasSubstr("several tables")));

  const Recording own_times = read_lvm(with(lvm_head, {{"X_Columns\tNo", "X_Columns\tMulti"}, {"deg\tVolts", "deg\t\tVolts"}}) + "X_Value\tAngle\tX_Value\tBridge\tComment\n0.5\t1\t0.5\t7\n0.502\t2\t0.502\t8\n", "f.lvm");
  ASSERT_EQ(own_times.channels.size(), 4u);
  EXPECT_EQ(own_times.channels[2].name, "X_Value of Bridge");
  EXPECT_EQ(own_times.channels[3].unit, "Volts");

  EXPECT_THAT(complaint([&] { read_lvm(lvm_head.substr(0, 300), "f.lvm"); }), HasSubstr("does not end"));
  EXPECT_THAT(complaint([&] { read_lvm(lvm_head, "f.lvm"); }), HasSubstr("f.lvm:"));
  EXPECT_THAT(complaint([&] { read_lvm(lvm_head + with(lvm_table, {{"0.75", "0.75\t1\t2"}}), "f.lvm"); }), HasSubstr("f.lvm:24: the row has")) << "lines are the file's";
}

TEST(Delimited, FindsDelimiterAndUnits) {
  const Values force{1.5, -2, 3e3};
  for (const auto& [text, format] : std::vector<std::pair<std::string, DelimitedFormat>>{
           {"Time [s],Force (N)\n0,1.5\n1,-2\n2,3e3\n", {}},
           {"Time [s];Force [N];\r\n0,0;1,5;\r\n1,0;-2;\r\n2,0;3e3;\r\n", {"", ",", 0, true}},
           {"Time [s]\tForce [N]\n0\t1.5\n1\t-2\n2\t3e3", {}},
           {"Time\tForce\ns\tN\n0\t1.5\n1\t-2\n2\t3e3\n", {}},
           {"Time;Force;\n[s];(N);\n0;1.5;\n1;-2;\n2;3e3;\n", {}},
           {"# by numpy.savetxt\n# Time[s] Force[N]\n0 1.5\n1 -2\n2 3e3\n", {}},
           {"Logger 7\n\nTime[s]  Force[N]\n 0  1.5\n 1  -2\n# remark\n 2  3e3\n", {"", ".", 2, true}},
           {"\xEF\xBB\xBF\"Time [s]\",\"Force [N]\"\n\"0\",\"1.5\"\n1,-2\n2,3e3\n", {}}}) {
    const Recording r = read_delimited(text, "f", format);
    ASSERT_EQ(r.channels.size(), 2u) << text;
    EXPECT_EQ(r.channels[1].name, "Force");
    EXPECT_EQ(r.channels[1].unit, "N");
    EXPECT_EQ(r.channels[1].value, force) << text;
  }
  for (const DelimitedFormat& format : {DelimitedFormat{"", ".", 0, false}, DelimitedFormat{}}) {  // said, or found out
    const Recording bare = read_delimited("# a remark of five words\n1 2\n3 nan\n", "f", format);
    EXPECT_EQ(bare.channels[0].name, "1");
    EXPECT_EQ(bare.channels[0].value, (Values{1, 3}));
    EXPECT_TRUE(std::isnan(bare.channels[1].value[1]));
  }
  EXPECT_EQ(read_delimited("1,2\n3,4\n", "f", {"", ".", 0, true}).channels[1].name, "2") << "names that are numbers, if they are said to be names";
}

TEST(Delimited, ReadsOtherEncodings) {
  const std::string utf8 = "angle(\xC2\xB0)\n1\n", latin1 = "angle(\xB0)\n1\n";
  std::string little = "\xFF\xFE", big = "\xFE\xFF";
  for (const char c : latin1) (little += c) += '\0', (big += '\0') += c;
  for (const std::string& text : {utf8, latin1, little, big}) {
    EXPECT_EQ(in_utf8(text), utf8);
    EXPECT_EQ(read_delimited(in_utf8(text), "f").channels[0].unit, "\xC2\xB0");
  }
  EXPECT_EQ(in_utf8("\xFF\xFE" "a"), "") << "half a letter";
  EXPECT_EQ(in_utf8("\xE2\x82"), "\xC3\xA2\xC2\x82") << "cut within a letter: no UTF-8";
  EXPECT_EQ(in_utf8("\xE2\x82\xAC"), "\xE2\x82\xAC");
}

TEST(Delimited, FindsTheTitlesAboveATable) {
  const std::string rows = "time (ms);force (N)\n0;1,5\n2;1,25\n4;1,0\n";
  for (const std::string titles : {"A recording\n\n", "A recording;\nof today;\n", "one\ntwo, with a comma\nthree: 3\n"}) {
    const Recording r = read_delimited(titles + rows, "f");
    ASSERT_EQ(r.channels.size(), 2u) << titles;
    EXPECT_EQ(r.channels[0].unit, "ms") << titles;
    EXPECT_EQ(r.channels[1].value, (std::vector<double>{1.5, 1.25, 1})) << titles;
    EXPECT_THAT(r.warnings.back(), HasSubstr("taken for titles"));
  }
  EXPECT_TRUE(read_delimited(rows, "f").warnings.empty());
  EXPECT_TRUE(read_delimited("# A recording\n" + rows, "f").warnings.empty()) << "remarks are no titles";
  EXPECT_EQ(read_delimited("A recording\nof today\n" + rows, "f", {"", "", 2, {}}).warnings.size(), 0u) << "where the mapping says so";
}

TEST(Delimited, RefusesWhatIsNoTable) {
  EXPECT_THAT(complaint([] { read_delimited("", "f"); }), HasSubstr("no table"));
  EXPECT_THAT(complaint([] { read_delimited("a,b\n", "f"); }), HasSubstr("no rows"));
  EXPECT_THAT(complaint([] { read_delimited("a,b\n1,2\n3\n", "f.txt"); }), HasSubstr("f.txt:3"));
  EXPECT_THAT(complaint([] { read_delimited("a,b\none,two\n", "f"); }), HasSubstr("\"one\""));
  EXPECT_THAT(complaint([] { read_delimited("a,b\ns,N\n1,2\nx,y\n", "f"); }), HasSubstr("\"x\""));
  EXPECT_THAT(complaint([] { read_delimited("a [s],b\ns,N\n1,2\n", "f"); }), HasSubstr("\"s\"")) << "units twice";
}

DelimitedFormat with_signs(const std::string& decimal, const std::string& thousands = "") {
  DelimitedFormat format;
  format.decimal = decimal;
  format.thousands = thousands;
  return format;
}

double number_in(const std::string& cell, const DelimitedFormat& format) { return read_delimited("b|a\n" + cell + "|\n", "f", format).channels.at(0).value.at(0); }
std::string refusal(const std::string& cell, const DelimitedFormat& format) {
  return complaint([&] { number_in(cell, format); });
}

/// "column:line: why" of what is left out.
std::vector<std::string> left_out(const std::string& text, const DelimitedFormat& format = {}) {
  std::vector<std::string> out;
  for (const LeftOutChannel& left : read_delimited(text, "f", format).left_out) out.push_back(left.name + ":" + std::to_string(left.line) + ": " + left.why);
  return out;
}

TEST(Delimited, NeverTakesASignOfThousandsForTheDecimalSign) {
  EXPECT_THAT(refusal("1.107", with_signs(",")), HasSubstr("f:2: no column holds numbers only: \"1.107\" has a point, while the decimal sign is a comma"));
  EXPECT_THAT(refusal("1.107", with_signs(",")), HasSubstr("thousands = \".\""));
  EXPECT_THAT(refusal("1.107,5", with_signs(",")), HasSubstr("has a point"));
  EXPECT_THAT(refusal("1,107", with_signs(".")), HasSubstr("has a comma, while the decimal sign is a point"));
  EXPECT_THAT(refusal("1,107", with_signs(".")), HasSubstr("thousands = \",\""));
  EXPECT_EQ(number_in("1.107", with_signs(".")), 1.107);
  EXPECT_EQ(number_in("1,107", with_signs(",")), 1.107);
}

TEST(Delimited, TakesThousandsOutWhereTheyAreSetOffWell) {
  for (const auto& [cell, format, value] : std::vector<std::tuple<std::string, DelimitedFormat, double>>{{"1.107", with_signs(",", "."), 1107},
                                                                                                         {"-1.107.250,5", with_signs(",", "."), -1107250.5},
                                                                                                         {"1107,5", with_signs(",", "."), 1107.5},
                                                                                                         {"1.107,5e1", with_signs("", "."), 11075},
                                                                                                         {"+12,107.25", with_signs(".", ","), 12107.25},
                                                                                                         {"1 107,5", with_signs(",", " "), 1107.5},
                                                                                                         {"1'107.5", with_signs("", "'"), 1107.5}})
    EXPECT_EQ(number_in(cell, format), value) << cell;
  for (const std::string cell : {"1.10", "1107.250", "1.1070", "1.107.25", ".107", "1.", "1.107,2.5", "0.500", "1,107.5", "1,2.000", "1..107"})
    EXPECT_THAT(refusal(cell, with_signs(",", ".")), HasSubstr("no number whose thousands are set off by \".\"")) << cell;
  EXPECT_EQ(read_delimited("a,b\n0,\"1,107.5\"\n", "f", with_signs("", ",")).channels[1].value[0], 1107.5);
  EXPECT_THAT(complaint([] { read_delimited("a,b\n0,1,107.5\n", "f", with_signs("", ",")); }), HasSubstr("no cell is quoted"));
  EXPECT_THAT(complaint([] { read_delimited("a b\n0 1 107.5\n", "f", with_signs("", " ")); }), HasSubstr("blanks"));
}

TEST(Delimited, FindsTheDecimalComma) {
  for (const std::string text : {"t;F\n0,000;1,5\n", "t\tF\n0,000\t1,5\n", "t|F\n0,000|1,5\n", "t F\n0,000 1,5\n", "0,000 1,5\n", "0,000;1,5\n"}) {
    const Recording r = read_delimited(text, "f");
    ASSERT_EQ(r.channels.size(), 2u) << text;
    EXPECT_EQ(r.channels[1].value, (Values{1.5})) << text;
    EXPECT_THAT(r.format, HasSubstr("the decimal sign is the comma")) << text;
  }
  EXPECT_EQ(read_delimited("t;F\n0;1.5\n", "f").format, "text");
  EXPECT_THAT(left_out("t;F\n0.5;1,5\n"), ElementsAre("F:2: \"1,5\" has a comma, while the decimal sign is a point")) << "the numbers contradict each other";
  EXPECT_THAT(left_out("t;F\n0;1,107\n1;2,250\n"), ElementsAre("F:2: \"1,107\" has a comma, while the decimal sign is a point")) << "1.107 or 1107: nobody can know";
  EXPECT_THAT(left_out("t;F\n0,5;1.107\n1;2.250\n"), ElementsAre("F:2: \"1.107\" has a point, while the decimal sign is a comma"));
  EXPECT_EQ(read_delimited("t;F\n0;1.107\n", "f").channels[1].value, (Values{1.107}));
  EXPECT_EQ(read_delimited("t;F\n0;1,107\n1;2,25\n", "f").channels[1].value, (Values{1.107, 2.25}));
}

TEST(Delimited, ReadsQuotedCellsWithTheirDelimiterAndQuotes) {
  const Recording quoted = read_delimited("t,a,F\n\"0,002\",\"2,5\",\"7,1\"\n", "f", with_signs(","));
  ASSERT_EQ(quoted.channels.size(), 3u);
  EXPECT_EQ(quoted.channels[2].value, (Values{7.1}));
  EXPECT_EQ(read_delimited("\"0,002\",\"2,5\"\n", "f", with_signs(",")).channels[1].value, (Values{2.5}));
  EXPECT_THAT(complaint([] { read_delimited("t,F\n0,5\n", "f", with_signs(",")); }), HasSubstr("no cell is quoted"));
  const Recording named = read_delimited("\"Time, measured\", \"Angle \"\"alpha\"\", raw [deg]\",5\" pipe\n0,1,2\n", "f");
  ASSERT_EQ(named.channels.size(), 3u);
  EXPECT_EQ(named.channels[0].name, "Time, measured");
  EXPECT_EQ(named.channels[1].name, "Angle \"alpha\", raw");
  EXPECT_EQ(named.channels[1].unit, "deg");
  EXPECT_EQ(named.channels[2].name, "5\" pipe");
}

TEST(Delimited, ReadsBarsAndLinesThatEndWithCarriageReturns) {
  EXPECT_EQ(read_delimited("t|F\n0|1\n1|2\n", "f").channels[1].value, (Values{1, 2}));
  EXPECT_EQ(read_delimited("t,|F|,a\n0,1,2\n", "f").channels.at(1).name, "|F|") << "a magnitude";
  const Recording old = read_delimited("# remark\rt,F\r0,1\r1,2\r", "f");
  ASSERT_EQ(old.channels.size(), 2u);
  EXPECT_EQ(old.channels[1].value, (Values{1, 2}));
  EXPECT_THAT(complaint([] { read_delimited("t,F\r0,1\r1\r", "f"); }), HasSubstr("f:3"));
}

TEST(Delimited, LeavesOutColumnsThatHoldText) {
  const Recording r = read_delimited("t,F,Status,G,\n0,1,OK,#N/A,\n1,2,,5,\n2,3,OK,6,\n", "f");
  ASSERT_EQ(r.channels.size(), 2u);
  EXPECT_EQ(r.channels[1].value, (Values{1, 2, 3}));
  EXPECT_THAT(left_out("t,F,Status,G\n0,1,OK,5\n1,2,,#N/A\n"), ElementsAre("Status:2: \"OK\" is no number", "G:3: \"#N/A\" is no number"));
  EXPECT_THAT(r.left_out.at(1).advice, HasSubstr("missing = [\"#N/A\"]"));
  EXPECT_THAT(left_out("t,,F\n0,,1\n"), ElementsAre("2:1: all its cells are empty"));
  EXPECT_THAT(complaint([] { read_delimited("t,Status\nstart,OK\n", "f"); }), HasSubstr("f:2: no column holds numbers only: \"start\" is no number, in the column \"t\""));
}

TEST(Delimited, ReadsMarksOfMissingSamples) {
  DelimitedFormat format;
  format.missing = {"ERR", "#N/A", "-9999"};
  const Recording r = read_delimited("t,F\n0,ERR\n#N/A,2\n2,-9999\n3,\n4,-9999.5\n", "f", format);
  ASSERT_EQ(r.channels.size(), 2u);
  ASSERT_EQ(r.channels[0].value.size(), 5u) << "a row that begins with # N/A is no remark";
  EXPECT_TRUE(std::isnan(r.channels[0].value[1]));
  for (const std::size_t k : {0, 2, 3}) EXPECT_TRUE(std::isnan(r.channels[1].value[k])) << k;
  EXPECT_EQ(r.channels[1].value[4], -9999.5);
  EXPECT_THAT(left_out("t,F\n0,1\n#DIV/0!,2\n# remark, one\n", {}), ElementsAre("t:3: \"#DIV/0!\" is no number"));
}

TEST(Delimited, ReadsRowsThatEndBeforeTheCommentColumn) {
  for (const std::string text : {"X_Value\tF\tComment\n0\t1\n1\t2\n", "X_Value\tF\tComment\n0\t1\tstart\n1\t2\n", "X_Value\tF\tComment\ns\tN\n0\t1\n1\t2\tend\n"}) {
    const Recording r = read_delimited(text, "f");
    ASSERT_EQ(r.channels.size(), 2u) << text;
    EXPECT_EQ(r.channels[1].value, (Values{1, 2})) << text;
    EXPECT_EQ(r.left_out.at(0).name, "Comment") << text;
  }
  EXPECT_THAT(left_out("t,F,a,b\n0,1\n1,2\n"), ElementsAre("a:2: the row ends before it", "b:2: the row ends before it"));
  EXPECT_THAT(left_out("t,F,a\n0,1\n1,2,3\n"), ElementsAre("a:2: the row ends before it")) << "no column with holes that nobody marked";
  EXPECT_THAT(complaint([] { read_delimited("t,F,a\n0,1,2\n1,2\n", "f"); }), HasSubstr("f:3: the row has 2 cells; wanted 3"));
  EXPECT_THAT(complaint([] { read_delimited("t,F,Status\n0,1,OK\n1,2", "f"); }), HasSubstr("f:3")) << "the end of the file may be cut off within the 2";
  EXPECT_THAT(complaint([] { read_delimited("Time [s]  F [N]\n0 1\n", "f"); }), HasSubstr("the row has 2 cells; wanted 4")) << "names with blanks are not to shift";
}

TEST(Delimited, TakesARowForTheUnitsOnlyWhereItHeadsNumbers) {
  const Recording units = read_delimited("t;F;Status\ns;N;\n0;;OK\n1;2;OK\n", "f");
  EXPECT_EQ(units.channels.at(1).unit, "N");
  EXPECT_EQ(units.channels.at(1).value.size(), 2u);
  const Recording none = read_delimited("F;Status\n;OK\n0.1;OK\n", "f");
  EXPECT_EQ(none.channels.at(0).value.size(), 2u) << "a row whose sample is missing stays a row";
}

TEST(Delimited, ReadsTimeStampsAsSecondsSinceTheFirst) {
  const auto seconds = [](const std::string& stamps) { return read_delimited("Time [ms];F\n" + stamps, "f").channels.at(0); };
  for (const std::string text : {"2026-12-31T23:59:59.998;1\n2027-01-01T00:00:00.500;2\n", "2026-12-31 23:59:59,998Z;1\n2027-01-01 01:00:00,500+01:00;2\n", "23:59:59.998;1\n00:00:00.500;2\n"}) {
    const RecordedChannel time = seconds(text);
    EXPECT_EQ(time.unit, "s") << text;
    ASSERT_EQ(time.value.size(), 2u);
    EXPECT_EQ(time.value[0], 0) << text;
    EXPECT_NEAR(time.value[1], 0.502, 1e-15) << text;
  }
  EXPECT_EQ(seconds("2024-02-28T12:00:00;1\n2024-03-01T12:00:00;2\n").value[1], 2 * 86400) << "a leap year";
  for (const std::string no_stamp : {"23.11.2026 12:00:00", "11/23/2026 12:00:00.0", "2026-02-29T12:00:00", "2026-11-23", "12:61:00", "12:00:00.", "2026-11-23T12:00:00 PM", "12:00:00Z"})
    EXPECT_THAT(left_out("t;F\n" + no_stamp + ";1\n"), ElementsAre(HasSubstr("t:2: \"" + no_stamp))) << no_stamp;
  EXPECT_THAT(left_out("t;F\n12:00:00;1\n5;2\n"), ElementsAre("t:3: \"5\" is no time stamp like \"12:00:00\" above it"));
  EXPECT_THAT(left_out("t;F\n5;1\n12:00:00;2\n"), ElementsAre(HasSubstr("t:3: \"12:00:00\"")));
  EXPECT_THAT(left_out("t;F\n12:00:00;1\n2026-11-23T12:00:01;2\n"), ElementsAre(HasSubstr("t:3")));
}

TEST(Delimited, SaysThatARowWithNumbersWasTakenForNames) {
  EXPECT_THAT(read_delimited("0,2,OK\n1,2,OK\n", "f").warnings, ElementsAre(HasSubstr("f:1: \"0\" is taken for the name"), HasSubstr("\"2\"")));
  EXPECT_THAT(read_delimited("t,F\n1,2\n", "f").warnings, IsEmpty());
}

void write_mat(const std::string& path, mat_ft version) {
  mat_t* file = Mat_CreateVer(path.c_str(), nullptr, version);
  ASSERT_NE(file, nullptr);
  double force[]{1, 2, 3}, matrix[]{1, 2, 3, 10, 20, 30};
  std::int16_t counts[]{7, 8, 9};
  std::size_t column[]{3, 1}, table[]{3, 2}, one[]{1, 1};
  const auto write = [&](matvar_t* v) {
    EXPECT_EQ(Mat_VarWrite(file, v, version == MAT_FT_MAT5 ? MAT_COMPRESSION_ZLIB : MAT_COMPRESSION_NONE), 0);
    Mat_VarFree(v);
  };
  write(Mat_VarCreate("force", MAT_C_DOUBLE, MAT_T_DOUBLE, 2, column, force, 0));
  write(Mat_VarCreate("m", MAT_C_DOUBLE, MAT_T_DOUBLE, 2, table, matrix, 0));
  write(Mat_VarCreate("counts", MAT_C_INT16, MAT_T_INT16, 2, column, counts, 0));
  const char* fields[]{"gauge"};
  matvar_t* structure = Mat_VarCreateStruct("data", 2, one, fields, 1);
  Mat_VarSetStructFieldByName(structure, "gauge", 0, Mat_VarCreate(nullptr, MAT_C_DOUBLE, MAT_T_DOUBLE, 2, column, force, 0));
  write(structure);
  Mat_Close(file);
}

Recording recording_in(const std::string& path) { return read_recording(path, "unrig_import = 1\n", "map.toml"); }

TEST(Mat, ReadsBothVersions) {
  const TemporaryDirectory directory;
  for (const mat_ft version : {MAT_FT_MAT5, MAT_FT_MAT73}) {
    const std::string path = directory.path("lab.mat");
    write_mat(path, version);
    const Recording r = recording_in(path);
    ASSERT_EQ(r.channels.size(), 5u);
    std::map<std::string, RecordedChannel> by_name;  // HDF5 sorts them
    for (const RecordedChannel& c : r.channels) by_name[c.name] = c;
    EXPECT_EQ(by_name["force"].value, (Values{1, 2, 3}));
    EXPECT_THAT(by_name["force"].raw, IsEmpty());
    EXPECT_EQ(by_name["m(:,2)"].value, (Values{10, 20, 30}));
    EXPECT_EQ(by_name["counts"].value, (Values{7, 8, 9}));
    EXPECT_THAT(by_name["counts"].raw, HasSubstr("integers"));
    EXPECT_EQ(by_name["data.gauge"].value, (Values{1, 2, 3}));
  }
}

/// The names of the columns in a cell array, and a matrix that stands on its side.
TEST(Mat, NamesColumnsByTheListsBesideThem) {
  const TemporaryDirectory directory;
  for (const mat_ft version : {MAT_FT_MAT5, MAT_FT_MAT73}) {
    const std::string path = directory.path("names.mat");
    mat_t* file = Mat_CreateVer(path.c_str(), nullptr, version);
    ASSERT_NE(file, nullptr);
    double matrix[]{0, 10, 1, 20, 2, 30};  // 2 x 3, column by column
    std::size_t wide[]{2, 3}, two[]{1, 2};
    const auto cell = [&](const char* name, const char* first, const char* second) {
      matvar_t* list = Mat_VarCreate(name, MAT_C_CELL, MAT_T_CELL, 2, two, nullptr, 0);
      int at = 0;
      for (const char* text : {first, second}) {
        std::size_t length[]{1, std::strlen(text)};
        Mat_VarSetCell(list, at++, Mat_VarCreate(nullptr, MAT_C_CHAR, MAT_T_UTF8, 2, length, const_cast<char*>(text), 0));
      }
      return list;
    };
    for (matvar_t* v : {Mat_VarCreate("data", MAT_C_DOUBLE, MAT_T_DOUBLE, 2, wide, matrix, 0), cell("names", "angle", "load cell"), cell("units", "deg", "N")}) {
      EXPECT_EQ(Mat_VarWrite(file, v, MAT_COMPRESSION_NONE), 0);
      Mat_VarFree(v);
    }
    Mat_Close(file);
    const Recording r = recording_in(path);
    ASSERT_EQ(r.channels.size(), 2u);
    EXPECT_EQ(r.channels[0].name, "data(1,:)");
    EXPECT_EQ(r.channels[0].label, "angle");
    EXPECT_EQ(r.channels[0].unit, "deg");
    EXPECT_EQ(r.channels[0].value, (Values{0, 1, 2}));
    EXPECT_EQ(r.channels[1].label, "load cell");
    EXPECT_EQ(r.channels[1].unit, "N");
    EXPECT_EQ(r.channels[1].value, (Values{10, 20, 30}));
  }
}

/// Written by h5py 3.7 as hdf5storage does: text attributes padded with NULs, at which libmatio finds no variable. The second has no sign of MATLAB in it.
TEST(Mat, ReadsWhatH5pyWrote) {
  const auto corpus = [](const std::string& name) { return recording_in(std::string(UNRIG_SOURCE_DIR) + "/tests/fuzz/corpus/mat73/" + name); };
  std::map<std::string, RecordedChannel> by_name;
  for (const RecordedChannel& c : corpus("h5py.mat").channels) by_name[c.name] = c;
  ASSERT_EQ(by_name.size(), 5u);
  EXPECT_EQ(by_name["force"].value.size(), 40u);
  EXPECT_NEAR(by_name["force"].value[10], std::sin(1.0), 1e-15);
  EXPECT_THAT(by_name["counts"].raw, HasSubstr("integers"));
  EXPECT_EQ(by_name["rec.data(3,:)"].label, "load cell");
  EXPECT_EQ(by_name["rec.data(3,:)"].unit, "N");
  EXPECT_NEAR(by_name["rec.data(3,:)"].value[39], 7 - 0.078, 1e-15);

  by_name.clear();
  for (const RecordedChannel& c : corpus("h5py_without_matlab.h5").channels) by_name[c.name] = c;
  ASSERT_EQ(by_name.size(), 3u);
  EXPECT_EQ(by_name["gauge"].value.size(), 40u);
  EXPECT_EQ(by_name["both(:,2)"].label, "gauge");
  EXPECT_EQ(by_name["both(:,2)"].value, by_name["gauge"].value);
}

TEST(Mat, RefusesWhatCannotBeRead) {
  const TemporaryDirectory directory;
  EXPECT_THAT(complaint([&] { recording_in(directory.path("absent.mat")); }), HasSubstr("cannot be read"));
  EXPECT_THAT(complaint([&] { recording_in(directory.file("text.mat", "MATLAB is not here")); }), HasSubstr("no MATLAB file"));
  write_mat(directory.path("whole.mat"), MAT_FT_MAT5);
  const std::string whole = [&] {
    std::ifstream file(directory.path("whole.mat"), std::ios::binary);
    return std::string(std::istreambuf_iterator<char>(file), {});
  }();
  for (const std::size_t length : {whole.size() / 2, std::size_t(128), std::size_t(140)}) {
    const std::string path = directory.file("cut.mat", whole.substr(0, length));
    const std::string said = complaint([&] {
      const Recording r = recording_in(path);
      for (const RecordedChannel& c : r.channels) EXPECT_EQ(c.value.size(), 3u) << c.name;  // what is handed on is whole
    });
    if (length <= 140) {
      EXPECT_THAT(said, HasSubstr("no variable"));
    }
  }
}

}  // namespace
}  // namespace unrig
