#include "core/run/run.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <limits>
#include <numbers>
#include <string>
#include <vector>

#include "core/run/run_limits.h"
#include "tests/core/run/written_run.h"
#include "tests/support/replaced.h"
#include "tests/support/shared_data.h"
#include "tests/support/temporary_directory.h"

namespace unrig {
namespace {

using test::TemporaryDirectory;
using test::head;
using test::read;
using test::refusal;
using test::replaced;
using test::small_table;
using test::values;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr double degree = std::numbers::pi / 180;

// ------------------------------------------------------------------------------------------------------ the plain case

TEST(Run, MetaDataAndColumnsInSi) {
  const unrig::Run run = read(head + small_table);
  EXPECT_EQ(run.name, "step_a");  // the file's name where the meta data have none
  EXPECT_EQ(run.kind, RunKind::step);
  EXPECT_EQ(run.medium, "");
  EXPECT_DOUBLE_EQ(run.density, 998.2);
  EXPECT_DOUBLE_EQ(run.speed, 0.6096);
  EXPECT_EQ(run.start, 0);
  EXPECT_DOUBLE_EQ(run.dt, 0.1);
  EXPECT_FALSE(run.resampled);
  ASSERT_EQ(run.samples(), 3);
  ASSERT_EQ(run.channels.size(), 2u);
  EXPECT_DOUBLE_EQ(run.channel("alpha").value[2], 3 * degree);
  EXPECT_EQ(run.channel("alpha").unit, "rad");
  EXPECT_EQ(run.channel("alpha").file_unit, "deg");
  EXPECT_DOUBLE_EQ(run.channel("alpha").factor, degree);
  EXPECT_THAT(values(run.channel("gauge")), ElementsAre(10, 20, 30));
  EXPECT_THAT(run.warnings, IsEmpty());
}

TEST(Run, KindsAndTheirNames) {
  for (const auto& [kind, name] : std::vector<std::pair<RunKind, std::string>>{
           {RunKind::step, "step"}, {RunKind::pluck, "pluck"}, {RunKind::forced, "forced"}, {RunKind::moved, "moved"}}) {
    EXPECT_EQ(to_string(kind), name);
    EXPECT_EQ(read(replaced(head, "step", name) + small_table).kind, kind);
  }
}

TEST(Run, AbsentColumnsAreNamed) {
  const unrig::Run run = read(head + small_table);
  EXPECT_EQ(run.find("force"), nullptr);
  try {
    run.channel("force");
    FAIL() << "no error";
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), AllOf(HasSubstr("step_a.csv: "), HasSubstr("\"force\""), HasSubstr("alpha, gauge")));
  }
}

std::string with_returns(std::string text) {
  for (char& c : text)
    if (c == '\n') c = '\r';
  return text;
}

TEST(Run, FormsOfTextThatMeanTheSame) {
  const unrig::Run plain = read(head + small_table);
  std::string crlf = head + small_table;
  for (std::size_t at = 0; (at = crlf.find('\n', at)) != std::string::npos; at += 2) crlf.replace(at, 1, "\r\n");
  const std::vector<std::string> forms = {
      crlf,
      "\xEF\xBB\xBF" + head + small_table,
      head + small_table.substr(0, small_table.size() - 1),
      head + small_table + "\n\n  \n",
      head + "# # a remark\n#\n\n" + small_table,
      head + replaced(small_table, "0.1,2,20", " 0.1 ,\t+2.0e0, 2e1 "),
      head + replaced(small_table, "time [s],alpha [deg]", "\"time [s]\" , alpha[deg]"),
      head + replaced(small_table, "alpha [deg],gauge [N]", "alpha (deg),\"gauge (N)\""),  // as spreadsheets write units
      head + replaced(small_table, "0.1,2,20", "\"0.1\", \"2\" ,\" 20 \""),
      with_returns(head + small_table),  // old Macintosh programs
  };
  for (const std::string& form : forms) {
    SCOPED_TRACE(form);
    const unrig::Run run = read(form);
    EXPECT_EQ(values(run.channel("alpha")), values(plain.channel("alpha")));
    EXPECT_EQ(values(run.channel("gauge")), values(plain.channel("gauge")));
    EXPECT_EQ(run.dt, plain.dt);
  }
}

TEST(Run, TimeInAnotherUnitAndAnotherPlace) {
  const unrig::Run run = read(head + "gauge [lbf],time [ms]\n1,100\n2,102\n3,104\n");
  EXPECT_DOUBLE_EQ(run.start, 0.1);
  EXPECT_DOUBLE_EQ(run.dt, 0.002);
  EXPECT_DOUBLE_EQ(run.channel("gauge").value[0], 4.4482216152605);
}

TEST(Run, MissingSamplesAreCountedPerColumn) {
  const unrig::Run run = read(head + "time [s],alpha [deg],gauge [N]\n0,,1\n1,NaN,2\n2,3,\n3,4,4\n");
  EXPECT_EQ(run.channel("alpha").missing, 2u);
  EXPECT_EQ(run.channel("gauge").missing, 1u);
  EXPECT_TRUE(std::isnan(run.channel("alpha").value[0]));
  EXPECT_DOUBLE_EQ(run.channel("alpha").value[2], 3 * degree);
  EXPECT_TRUE(std::isnan(run.channel("gauge").value[2]));
}

// ------------------------------------------------------------------------------------------------------ unknown columns

TEST(Run, UnknownColumnsAreKept) {
  const unrig::Run run = read(head + "time [s],heave [mm],tick [furlong_ticks],gauge [N]\n0,1,7,1\n1,2,8,2\n2,3,9,3\n");
  EXPECT_DOUBLE_EQ(run.channel("heave").value[1], 0.002);
  EXPECT_EQ(run.channel("heave").unit, "m");
  EXPECT_THAT(values(run.channel("tick")), ElementsAre(7, 8, 9));
  EXPECT_EQ(run.channel("tick").unit, "furlong_ticks");
  EXPECT_EQ(run.channel("tick").factor, 1);
}

TEST(Run, UnknownColumnsOfTextAreLeftOutWithAWarning) {
  const unrig::Run run = read(head + "time [s],note [1],gauge [N]\n0,,1\n1,\"late, but fine\",2\n2,3,3\n");
  EXPECT_EQ(run.find("note"), nullptr);
  EXPECT_EQ(run.channels.size(), 1u);
  EXPECT_THAT(run.warnings, ElementsAre(AllOf(HasSubstr(":7: "), HasSubstr("\"note\""), HasSubstr("late, but fine"))));
}

// ------------------------------------------------------------------------------------------------------ calibration

std::string volts(const std::string& unit, const std::string& meta_data) {
  return head + meta_data + "time [s],force [" + unit + "],gauge [" + unit + "]\n0,1,1\n1,2,2\n2,3,3\n";
}

TEST(Run, CalibrationTurnsVoltsAndCountsIntoReadings) {
  const unrig::Run run = read(volts("V", "# calibration = \"4.4 N/V\"\n# force_calibration = \"-2 lbf/V\"\n"));
  EXPECT_DOUBLE_EQ(run.channel("gauge").value[1], 8.8);
  EXPECT_EQ(run.channel("gauge").unit, "N");
  EXPECT_EQ(run.channel("gauge").file_unit, "V");
  EXPECT_DOUBLE_EQ(run.channel("force").value[1], -4 * 4.4482216152605);
  EXPECT_THAT(run.warnings, IsEmpty());

  EXPECT_DOUBLE_EQ(read(volts("mV", "# calibration = \"4.4 N/V\"\n")).channel("gauge").factor, 4.4e-3);
  EXPECT_DOUBLE_EQ(read(volts("V", "# calibration = \"3 deg/V\"\n")).channel("gauge").factor, 3 * degree);
  EXPECT_EQ(read(volts("V", "# calibration = \"3 lbf.in/V\"\n")).channel("gauge").unit, "N.m");
  EXPECT_DOUBLE_EQ(read(volts("counts", "# calibration = \"0.01 N\"\n")).channel("gauge").factor, 0.01);
  EXPECT_DOUBLE_EQ(read(volts("1", "# calibration = \"0.01 N/count\"\n")).channel("gauge").factor, 0.01);
}

TEST(Run, WithoutCalibrationVoltsAndCountsStayWithAWarning) {
  const unrig::Run run = read(volts("mV", ""));
  EXPECT_EQ(run.channel("gauge").unit, "V");
  EXPECT_DOUBLE_EQ(run.channel("gauge").factor, 1e-3);
  EXPECT_THAT(run.warnings, ElementsAre(HasSubstr("force_calibration"), HasSubstr("no calibration")));
  EXPECT_THAT(read(volts("N.m", "")).warnings, IsEmpty());
}

TEST(Run, ACalibrationThatDoesNotFitItsColumnIsAnError) {
  EXPECT_THAT(refusal(volts("N", "# calibration = \"4.4 N/V\"\n")), AllOf(HasSubstr("step_a.csv:5: "), HasSubstr("is in N already")));
  EXPECT_THAT(refusal(volts("V", "# calibration = \"4.4 N\"\n")), AllOf(HasSubstr(":5: "), HasSubstr("wanted a reading per volt")));
  EXPECT_THAT(refusal(volts("counts", "# calibration = \"4.4 N/V\"\n")), HasSubstr("wanted a reading per count"));
  EXPECT_THAT(refusal(volts("V", "# calibration = \"4.4\"\n")), HasSubstr("has no unit"));
  EXPECT_THAT(refusal(volts("V", "# calibration = 4.4\n")), HasSubstr("wanted text"));
  EXPECT_THAT(refusal(volts("V", "# calibration = \"0 N/V\"\n")), HasSubstr("not zero"));
  EXPECT_THAT(refusal(volts("V", "# calibration = \"1 Nfoo/V\"\n")), HasSubstr("unknown unit \"Nfoo/V\""));
  EXPECT_THAT(read(head + "# force_calibration = \"1 N/V\"\n" + small_table).warnings, ElementsAre(HasSubstr("not used")));
}

// ------------------------------------------------------------------------------------------------------ weights

TEST(Run, WeightNeedsNoUnit) {
  const unrig::Run run = read(head + "time [s],gauge [N],weight\n0,1,1\n1,2,0\n2,3,0.5\n");
  EXPECT_THAT(values(run.channel("weight")), ElementsAre(1, 0, 0.5));
}

TEST(Run, WeightsThatAreNoWeights) {
  EXPECT_THAT(refusal(head + "time [s],gauge [N],weight\n0,1,1\n1,2,-1\n2,3,1\n"), AllOf(HasSubstr(":7: "), HasSubstr("weight is -1")));
  EXPECT_THAT(refusal(head + "time [s],gauge [N],weight\n0,1,1\n1,2,\n2,3,1\n"), AllOf(HasSubstr(":7: "), HasSubstr("missing")));
  EXPECT_THAT(refusal(head + "time [s],gauge [N],weight\n0,1,0\n1,2,0\n2,3,0\n"), HasSubstr("every weight is zero"));
}

// ------------------------------------------------------------------------------------------------------ what cannot be used

struct Unusable {
  const char* what;
  std::string text;
  const char* says;
};

TEST(Run, WhatCannotBeUsedIsNamedWithItsLine) {
  const std::string good = head + small_table;
  const std::vector<Unusable> cases = {
      {"empty file", "", "step_a.csv:1: the file does not say that it is a run file"},
      {"no meta data", small_table, "unrig_run = 1"},
      {"no magic", replaced(good, "# unrig_run = 1\n", ""), "unrig_run = 1"},
      {"another version", replaced(good, "run = 1", "run = 2"), "step_a.csv:1: unrig_run is 2"},
      {"magic as text", replaced(good, "run = 1", "run = \"1\""), "whole number"},
      {"unknown key", replaced(good, "# speed", "# sped = 1\n# speed"),
       "step_a.csv:4: the key \"sped\" is unknown; wanted one of: unrig_run, name"},
      {"unknown kind", replaced(good, "\"step\"", "\"stepp\""), "step_a.csv:2: kind is \"stepp\"; wanted \"step\", \"pluck\""},
      {"no kind", replaced(good, "# kind = \"step\"\n", ""), "lacks the key \"kind\""},
      {"no density", replaced(good, "# density = \"998.2 kg/m^3\"\n", ""), "lacks the key \"density\""},
      {"no speed", replaced(good, "# speed = \"2 ft/s\"\n", ""), "lacks the key \"speed\""},
      {"density without unit", replaced(good, "\"998.2 kg/m^3\"", "998.2"), "step_a.csv:3: density = 998.2 has no unit"},
      {"density as text without unit", replaced(good, "998.2 kg/m^3", "998.2"), "has no unit"},
      {"density in newton", replaced(good, "kg/m^3", "N"), "step_a.csv:3: density has the unit \"N\"; wanted a density"},
      {"negative speed", replaced(good, "2 ft/s", "-2 ft/s"), "step_a.csv:4: speed is -0.6096 m/s"},
      {"speed that is no number", replaced(good, "2 ft/s", "fast"), "step_a.csv:4: speed is \"fast\""},
      {"a remark that is no TOML", replaced(good, "# speed", "# measured on Monday\n# speed"), "step_a.csv:4: "},
      {"a key given twice", replaced(good, "# speed", "# kind = \"step\"\n# speed"), "step_a.csv:4: "},
      {"UTF-16", "\xFF\xFE#", "UTF-16"},
      {"nothing below the meta data", head, "ends after its meta data"},
      {"no header", replaced(good, "time [s],alpha [deg],gauge [N]\n", ""), "step_a.csv:5: the row \"0.0,1,10\" is no header"},
      {"no time", replaced(good, "time", "t"), "step_a.csv:5: the header has no column \"time\""},
      {"time alone", head + "time [s]\n0\n1\n2\n", "only column"},
      {"time in metres", replaced(good, "time [s]", "time [m]"), "step_a.csv:5: the column \"time\" has the unit \"m\"; wanted a time"},
      {"column without unit", replaced(good, "gauge [N]", "gauge"),
       "step_a.csv:5: the column \"gauge\" has no unit; wanted `gauge [unit]`"},
      {"column with empty unit", replaced(good, "[N]", "[]"), "the column \"gauge\" has no unit"},
      {"gauge in an unknown unit", replaced(good, "[N]", "[Newtonz]"),
       "step_a.csv:5: the column \"gauge\" has the unknown unit \"Newtonz\""},
      {"alpha in metres", replaced(good, "[deg]", "[m]"), "the column \"alpha\" has the unit \"m\"; wanted an angle"},
      {"alpha in counts", replaced(good, "[deg]", "[counts]"), "wanted an angle"},
      {"column given twice", replaced(good, "gauge [N]", "alpha [rad]"),
       "step_a.csv:5: the header names the column \"alpha\" more than once"},
      {"column without name", replaced(good, "gauge [N]", "[N]"), "column without a name"},
      {"semicolons", head + "time [s];gauge [N]\n0;1\n1;2\n2;3\n", "semicolons"},
      {"row too short", replaced(good, "0.1,2,20", "0.1,2"), "step_a.csv:7: the row has 2 cells; wanted 3"},
      {"row too long", replaced(good, "0.1,2,20", "0.1,2,20,4"), "step_a.csv:7: the row has 4 cells; wanted 3"},
      {"cut off", good.substr(0, good.size() - 4), "step_a.csv:8: the file ends in the middle of a row"},
      {"blank line between rows", replaced(good, "0.1,", "\n0.1,"), "step_a.csv:7: a blank line"},
      {"Latin-1", replaced(good, "[deg]", "[\xB0]"), "step_a.csv:5: the file is not UTF-8: the byte 0xB0 here is \"\xC2\xB0\" in Latin-1; wanted UTF-8"},
      {"Latin-1 in the meta data", replaced(good, "# speed", "# medium = \"L\xF6sung\"\n# speed"), "step_a.csv:4: the file is not UTF-8"},
      {"Latin-1 in a cell", replaced(good, "2,20", "2,\xB5"), "step_a.csv:7: the column \"gauge\" holds \"\xC2\xB5\""},
      {"decimal comma in quotes", replaced(good, "2,20", "2,\"2,0\""), "step_a.csv:7: the column \"gauge\" holds \"2,0\""},
      {"an Excel workbook", std::string("PK\x03\x04\x14\0", 6), "step_a.csv: this is an Excel workbook (.xlsx)"},
      {"TDMS", "TDSm", "this is an NI TDMS file; wanted a run file, with `# unrig_run = 1` at its head. `unrig import` makes a run file of it."},
      {"a rig file", "# the rig\nunrig_rig = 1\nname = \"rig\"\n", "step_a.csv:1: this is a rig file; wanted a run file, with `# unrig_run = 1` at its head. Have two files been exchanged"},
      {"a mapping", "unrig_import = 1\n", "this is a mapping"},
      {"a result", "{\n  \"unrig\": \"fit\"\n}", "this is a result of unrig (JSON)"},
      {"another binary file", std::string("\x7f\0\1\2", 4), "binary file"},
      // What no instrument reads and no fluid is (core/run/run_limits.h has the sources).
      {"a fluid denser than osmium", replaced(good, "998.2 kg/m^3", "1e30 kg/m^3"), "step_a.csv:3: density is 1e+30 kg/m^3; wanted at most 22590, that of osmium"},
      {"faster than light", replaced(good, "2 ft/s", "1e300 m/s"), "step_a.csv:4: speed is 1e+300 m/s; wanted at most 2.99792e+08, the speed of light"},
      {"readings whose squares overflow", head + "time [s],alpha [deg],gauge [N]\n0,1,1e308\n0.1,2,-1e308\n0.2,3,1e308\n", "the column \"gauge\""},
      {"a calibration that makes such", replaced(replaced(good, "[N]", "[V]"), "# speed", "# calibration = \"1e200 N/V\"\n# speed"),
       "step_a.csv:7: the column \"gauge\" reads 10 V; wanted a reading of an instrument, within 3.4e+38 N"},
      {"readings whose squares vanish", head + "time [s],alpha [deg],gauge [N]\n0,1,1e-300\n0.1,2,2e-300\n0.2,3,3e-300\n", "step_a.csv:5: the column \"gauge\" varies by 2e-300 N only"},
      {"times beyond all time", head + "time [s],alpha [deg]\n0,1\n1e307,2\n2e307,3\n", "step_a.csv:7: the time is 1e+307 s; wanted a time within 4.4e+17 s"},
      {"samples closer than any instrument takes them", head + "time [s],alpha [deg]\n0,1\n1e-300,2\n2e-300,3\n", "step_a.csv:5: the samples are 1e-300 s apart"},
      {"samples further apart than a year", head + "time [s],alpha [deg]\n0,1\n1e8,2\n2e8,3\n", "step_a.csv:5: the samples are 1e+08 s apart"},
      {"text", replaced(good, "2,20", "2,abc"), "step_a.csv:7: the column \"gauge\" holds \"abc\""},
      {"number with a tail", replaced(good, "2,20", "2,20N"), "step_a.csv:7: the column \"gauge\" holds \"20N\""},
      {"infinity", replaced(good, "2,20", "2,inf"), "step_a.csv:7: the column \"gauge\" holds \"inf\""},
      {"number beyond the range", replaced(good, "2,20", "2,1e999"), "holds \"1e999\""},
      {"text for a time", replaced(good, "0.1,", "0.1s,"), "step_a.csv:7: the column \"time\" holds \"0.1s\""},
      {"a second file behind the first", good + good, "step_a.csv:9: "},
      {"column without a number", head + "time [s],gauge [N]\n0,\n1,nan\n2,\n", "step_a.csv:5: the column \"gauge\" has no number"},
      {"no rows", head + "time [s],gauge [N]\n", "0 rows follow the header; wanted three"},
      {"two rows", head + "time [s],gauge [N]\n0,1\n1,2\n", "2 rows follow the header; wanted three"},
      {"nothing but text beside time", head + "time [s],note [1]\n0,a\n1,b\n2,c\n", "no column but \"time\" holds numbers"},
  };
  for (const Unusable& one : cases) EXPECT_THAT(refusal(one.text), HasSubstr(one.says)) << one.what;
}

/// A dead encoder was "a transform needs finite samples" after ten seconds.
TEST(Run, WhatDrivesARunOfItsKindMustChange) {
  const auto refused = [](const std::string& text) -> std::string {
    try {
      check_what_drives(read(text));
    } catch (const InputError& error) {
      return error.what();
    }
    return "no error";
  };
  const std::string forced = replaced(head, "step", "forced"), moved = replaced(head, "step", "moved"), mount = "time [s],mount_velocity [m/s],mount_acceleration [m/s^2],gauge [N]\n";
  EXPECT_THAT(refused(head + "time [s],alpha [deg],gauge [N]\n0,2.07,10\n0.1,2.07,20\n0.2,2.07,30\n"),
              AllOf(HasSubstr("step_a.csv:5: the column \"alpha\" never changes, it is 2.07 deg throughout; wanted what drives a run of the kind \"step\". "), HasSubstr("dead encoder")));
  EXPECT_THAT(refused(head + "time [s],alpha [deg],weight\n0,2,0\n0.1,3,1\n0.2,3,1\n0.3,,1\n"), HasSubstr("\"alpha\" never changes")) << "where it counts";
  EXPECT_THAT(refused(head + "time [s],alpha [deg],weight\n0,2,0\n0.1,,1\n0.2,,1\n"), HasSubstr("the column \"alpha\" has no number in a row that counts"));
  EXPECT_THAT(refused(forced + "time [s],force [N],gauge [N]\n0,0,10\n0.1,0,20\n0.2,0,30\n"), HasSubstr("step_a.csv:5: the column \"force\" never changes, it is 0 N"));
  EXPECT_THAT(refused(moved + mount + "0,1,0,10\n0.1,1,0,20\n0.2,1,0,30\n"), HasSubstr("\"mount_velocity\" never changes"));
  EXPECT_THAT(refused(moved + mount + "0,1,0,10\n0.1,1,1,20\n0.2,1,0,30\n"), "no error") << "one of two is enough";
  EXPECT_THAT(refused(replaced(head, "step", "pluck") + "time [s],alpha [deg],gauge [N]\n0,2,10\n0.1,2,20\n0.2,2,30\n"), "no error") << "an airfoil at a constant angle";
}

TEST(Run, AColumnThatNoInstrumentReadAndNobodyNeedsIsLeftOut) {
  const unrig::Run run = read(head + "time [s],alpha [deg],odd [V]\n0,1,1e-300\n0.1,2,2e-300\n0.2,3,3e-300\n");
  EXPECT_EQ(run.find("odd"), nullptr);
  EXPECT_THAT(run.warnings, ElementsAre(AllOf(HasSubstr("step_a.csv:5: the column \"odd\" varies by 2e-300 V only"), HasSubstr("It is left out."))));
}

/// Each name was compared with each: minutes.
TEST(Run, AHundredThousandColumnsAreReadInSeconds) {
  std::string text = head + "time [s],alpha [deg]", row[3];
  for (int c = 0; c < 100'000; ++c) {
    text += fmt::format(",channel {} [odd{}]", c, c % 10);
    for (std::string& cells : row) cells += ",1.5";
  }
  for (int k = 0; k < 3; ++k) text += fmt::format("\n{},{}", k, k) + row[k];
  const auto begin = std::chrono::steady_clock::now();
  EXPECT_EQ(read(text + "\n").channels.size(), 100'001u);
  EXPECT_LT(std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count(), 20) << "0.2 s measured";
}

TEST(Run, AFileThatIsNotThere) { EXPECT_THROW(read_run("/nonexistent/run.csv"), InputError); }

// ------------------------------------------------------------------------------------------------------ real recordings

TEST(RunRecordings, ForcePlateJittersAndRepeatsAStamp) {
  const std::string file = "real/force_plate/RandomFastSpeed1.csv";
  UNRIG_NEEDS_SHARED(file);
  const unrig::Run run = read_run(test::shared_path(file));
  EXPECT_EQ(run.samples(), 12000);
  EXPECT_TRUE(run.resampled);
  EXPECT_EQ(run.channel("gauge").unit, "N.m");
  EXPECT_NEAR(run.dt, 0.01, 1e-6);  // the last stamp is within one step of its place after 12000
  EXPECT_LT(run.largest_jitter, 0.001);
}

TEST(RunRecordings, OscillatorsStampsAreRoundedAndItsVoltsCalibrated) {
  const std::string file = "real/oscillator/multisine.csv";
  UNRIG_NEEDS_SHARED(file);
  const unrig::Run run = read_run(test::shared_path(file));
  EXPECT_FALSE(run.resampled);
  EXPECT_EQ(run.channel("gauge").unit, "N");
  EXPECT_EQ(run.channel("gauge").value[0], -0.0101019);
  EXPECT_NEAR(run.dt, 1 / 610.35, 1e-8);  // 610.35 Hz is given with five digits
}

}  // namespace
}  // namespace unrig
