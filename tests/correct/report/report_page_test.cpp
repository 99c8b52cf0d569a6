// The page of the report as such: what it keeps of long records, and that nothing in the data can leave its place.

#include "correct/report/report_page.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <regex>

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::VectorXd;
using nlohmann::json;
using ::testing::HasSubstr;
using ::testing::Not;

json data_of(const std::string& html) {
  const std::string open = "id=\"report-data\">";
  const std::size_t first = html.find(open) + open.size();
  return json::parse(html.substr(first, html.find("</script>", first) - first));
}

TEST(ReportPage, ThinsLongRecordsWithoutLosingAnExtreme) {
  const Index samples = 1'000'000;
  Plot plot{"", "time [s]", "gauge [N]", VectorXd::LinSpaced(samples, 0, 1), {{"a", 0, VectorXd::Zero(samples)}, {"b", 1, VectorXd::Ones(samples)}}};
  plot.curves[0].value[123456] = 7;
  plot.curves[0].value[654321] = -7;
  plot.curves[1].value[777777] = std::numeric_limits<double>::quiet_NaN();
  const std::vector<Index> rows = kept_rows(plot, 6000);
  EXPECT_LE(rows.size(), 6000u);
  EXPECT_TRUE(std::is_sorted(rows.begin(), rows.end()));
  EXPECT_EQ(std::adjacent_find(rows.begin(), rows.end()), rows.end());
  for (const Index spike : {123456, 654321}) EXPECT_TRUE(std::binary_search(rows.begin(), rows.end(), spike)) << spike;

  ReportPage page("long");
  page.add_plot(plot);
  const json block = data_of(page.html())["blocks"][0];
  EXPECT_EQ(block["x"].size(), rows.size());
  EXPECT_EQ(block["series"][0]["v"].size(), rows.size());
  EXPECT_THAT(block["caption"].get<std::string>(), HasSubstr("of 1000000 samples"));
}

TEST(ReportPage, KeepsTheDetailOfAShortEventInALongRecord) {
  // Two hundred samples of ringing in a million of noise a hundredth as large.
  const Index samples = 1'000'000, event = 400'000;
  VectorXd y(samples);
  for (Index k = 0; k < samples; ++k) {
    const double t = static_cast<double>(k - event), noise = 0.01 * std::sin(static_cast<double>(k * k));
    y[k] = noise + (t >= 0 && t < 200 ? std::sin(0.3 * t) : 0);
  }
  const VectorXd x = VectorXd::LinSpaced(samples, 0, 1);
  Plot own{"", "time [s]", "gauge [N]", x, {{"gauge", 0, y}}}, residual{"", "time [s]", "gauge [N]", x, {{"residual", 0, x}}};
  residual.busy = y;  // a plot beside it has its detail in the same places
  for (const Plot& plot : {own, residual}) {
    const std::vector<Index> rows = kept_rows(plot, 6000);
    EXPECT_LE(rows.size(), 6000u);
    const auto kept_in = [&](Index first, Index last) { return std::lower_bound(rows.begin(), rows.end(), last) - std::lower_bound(rows.begin(), rows.end(), first); };
    EXPECT_GT(kept_in(event, event + 200), 150);
    for (Index first = 0; first < samples; first += samples / 1000) EXPECT_GE(kept_in(first, first + 2 * samples / 1000), 1) << "no stretch is forgotten";
  }
}

TEST(ReportPage, KeepsShortRecordsAsTheyAre) {
  const Plot plot{"", "x", "y", VectorXd::LinSpaced(3, 0, 1), {{"a", 0, Eigen::Vector3d(1, std::nan(""), 3), Eigen::Vector3d(.1, .2, .3)}}};
  ReportPage page("short");
  page.add_plot(plot);
  const json series = data_of(page.html())["blocks"][0]["series"][0];
  EXPECT_EQ(series["v"], json::parse("[1.0, null, 3.0]"));
  EXPECT_EQ(series["std"], json::parse("[0.1, 0.2, 0.3]"));
}

TEST(ReportPage, TextCannotEndTheScriptThatHoldsIt) {
  const std::string hostile = "</script><script>alert(1)</script><!--\xff";  // and no valid UTF-8
  ReportPage page(hostile);
  page.add_verdict(Tone::bad, hostile, hostile);
  page.add_table(hostile, {hostile}, {{hostile}});
  const std::string html = page.html();
  EXPECT_THAT(html, Not(HasSubstr("alert(1)</script>")));
  EXPECT_EQ(data_of(html)["verdicts"][0]["text"], "</script><script>alert(1)</script><!--\xEF\xBF\xBD");
}

TEST(ReportPage, LoadsNothingFromElsewhere) {
  const std::string html = ReportPage("alone").html();
  for (const char* asks : {"<link rel=\"stylesheet", "<script src", "<img", "<iframe", "@import", "url(", "sourceMappingURL", "XMLHttpRequest(\"http", "fetch("})
    EXPECT_THAT(html, Not(HasSubstr(asks))) << asks;
  EXPECT_THAT(html, HasSubstr("Permission is hereby granted"));  // dygraphs' licence travels with it
  EXPECT_THAT(html, Not(HasSubstr("UNRIG_")));                   // every placeholder was filled
}

TEST(ReportPage, RefusesCurvesOfOtherLength) {
  ReportPage page("");
  EXPECT_THROW(page.add_plot({"", "x", "y", VectorXd::Zero(3), {{"a", 0, VectorXd::Zero(2)}}}), std::invalid_argument);
  EXPECT_THROW(page.add_plot({"", "x", "y", VectorXd::Zero(3), {{"a", 0, VectorXd::Zero(3), VectorXd::Zero(4)}}}), std::invalid_argument);
  Plot plot{"", "x", "y", VectorXd::Zero(3), {{"a", 0, VectorXd::Zero(3)}}};
  plot.busy = VectorXd::Zero(2);
  EXPECT_THROW(page.add_plot(plot), std::invalid_argument);
}

}  // namespace
}  // namespace unrig
