// Text tables: delimiters, encodings, signs of the decimal, units, marks of missing samples.

#include "core/import/delimited.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <tuple>
#include <vector>

#include "core/files/error.h"
#include "tests/support/complaint.h"

namespace unrig {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using test::complaint;
using Values = std::vector<double>;

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

}  // namespace
}  // namespace unrig
