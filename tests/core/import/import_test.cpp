// The mapping from a laboratory's file to a run file, and LabVIEW's text files.

#include "core/import/import.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <string>
#include <vector>

#include "core/files/error.h"
#include "core/import/channel_list.h"
#include "core/import/delimited.h"
#include "core/import/import_template.h"
#include "core/import/lvm.h"
#include "core/run/run.h"
#include "tests/support/complaint.h"
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
using test::complaint;
using Values = std::vector<double>;

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

}  // namespace
}  // namespace unrig
