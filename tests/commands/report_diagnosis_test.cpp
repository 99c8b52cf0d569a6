// `unrig report`: what stands in the page of a diagnosis.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <map>

#include "core/files/text_file.h"
#include "tests/commands/report_page.h"
#include "tests/commands/report_results.h"

namespace unrig {
namespace {

using nlohmann::json;
using test::Finished;
using test::TemporaryDirectory;
using test::blocks;
using test::made_up_diagnosis;
using test::make_results;
using test::page_data;
using test::plot_titled;
using test::run_unrig;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

TEST(ReportOfADiagnosis, ShowsADiagnosis) {
  const TemporaryDirectory directory;
  const std::string file = directory.file("diagnosis.json", made_up_diagnosis().dump()), output = directory.path("report.html");
  ASSERT_EQ(run_unrig(directory, {"report", file, "-o", output}).status, 0);
  const json data = page_data(output);
  EXPECT_EQ(data["verdicts"][0]["text"], "Missing physics: quadratic-drag (probability 0.99).");
  EXPECT_EQ(data["verdicts"][1]["text"], "These recordings cannot tell apart: tank-wave, vortex-shedding.");
  const std::vector<json> maps = blocks(data, "map");
  ASSERT_EQ(maps.size(), 2u);
  EXPECT_EQ(maps[0]["z"].size(), 3u);
  EXPECT_EQ(maps[0]["z"][2][4], 20.0);
  EXPECT_TRUE(maps[1]["z"][1][2].is_null());
  EXPECT_THAT(maps[0]["caption"].get<std::string>(), ::testing::AllOf(HasSubstr("less weight for the runs that it cannot explain"), ::testing::Not(HasSubstr("nothing but noise")))) << "this one goes to the top";
  json cut = made_up_diagnosis();
  cut["improvement"]["runs"][0]["map"]["time_frequency"]["noise_above"] = true;
  ASSERT_EQ(run_unrig(directory, {"report", directory.file("cut.json", cut.dump()), "-o", output}).status, 0);
  EXPECT_THAT(blocks(page_data(output), "map")[0]["caption"].get<std::string>(), HasSubstr("Higher frequencies hold nothing but noise."));
  EXPECT_EQ(blocks(data, "plot").size(), 4u);
  EXPECT_EQ(blocks(data, "table").size(), 4u);
  // The mismatch, 0.2 to 1.4 s and 2 to 4 Hz, is boxed wherever time or frequency is an axis.
  const json time = {{"from", 0.2}, {"to", 1.4}, {"name", "mismatch"}}, frequency = {{"from", 2.0}, {"to", 4.0}, {"name", "mismatch"}};
  EXPECT_EQ((*plot_titled(data, "recording and models"))["boxes"], json::array({time}));
  EXPECT_EQ((*plot_titled(data, "residuals"))["boxes"], json::array({time}));
  EXPECT_EQ((*plot_titled(data, "spectra of the residual before and after"))["boxes"], json::array({frequency}));
  EXPECT_EQ(maps[0]["boxes"], json::parse(R"([{"from": 0.2, "to": 1.4, "low": 2.0, "high": 4.0}])"));
  std::vector<std::string> chapters;
  for (const json& heading : blocks(data, "heading")) chapters.push_back(heading["title"]);
  EXPECT_THAT(chapters, ::testing::ElementsAre("Where it is", "What it is", "Before and after", "What else was tried")) << "no chapter of which the file says nothing";
}

TEST(ReportOfADiagnosis, ADiagnosisShowsItsRecordingsAndBothModels) {
  const TemporaryDirectory directory;
  const std::string wave = test::source_path("sample_data/campaigns/wave/"), without = directory.path("without.json"), with = directory.path("with.json");
  std::vector<std::string> fit{"fit", "--rig", wave + "rig.toml", wave + "dry_pluck.csv", wave + "wet_pluck.csv", wave + "step_a.csv", "-o", without};
  ASSERT_GE(run_unrig(directory, fit).status, 0);
  fit.back() = with;
  fit.insert(fit.end(), {"--effect", "tank-wave"});
  ASSERT_EQ(run_unrig(directory, fit).status, 0);
  // What `unrig diagnose` would write of these two.
  json diagnosis = made_up_diagnosis();
  diagnosis["fit"] = json::parse(read_text(with));
  const json before = json::parse(read_text(without)), parameters = before["parameters"];
  for (const json& p : parameters) diagnosis["price_of_ignorance"].push_back({{"name", p["name"]}, {"run", p.value("run", "")}, {"without", p["value"]}, {"with", 0}, {"std_error", 1}, {"unit", ""}});
  diagnosis["improvement"]["runs"] = {{{"file", wave + "step_a.csv"}, {"heldout", false}, {"rms_before", 0.2}, {"rms_after", 0.011}, {"noise", 0.01}, {"unit", "N"}}};
  const std::string output = directory.path("report.html");
  const Finished finished = run_unrig(directory, {"report", directory.file("diagnosis.json", diagnosis.dump()), "-o", output});
  ASSERT_EQ(finished.status, 0) << finished.err;
  const json data = page_data(output);
  ASSERT_TRUE(plot_titled(data, "gauge: recording and models"));
  EXPECT_EQ((*plot_titled(data, "gauge: recording and models"))["series"].size(), 3u);
  ASSERT_TRUE(plot_titled(data, "gauge: spectra of the residual before and after"));
  const json* residuals = plot_titled(data, "gauge: residuals");
  ASSERT_TRUE(residuals);
  EXPECT_FALSE(plot_titled(data, "alpha: residuals"));
  const std::pair<const json&, std::size_t> models[] = {{before, 0}, {diagnosis["fit"], 1}};
  for (const auto& [model, curve] : models) {
    double sum = 0, count = 0;
    for (const json& v : (*residuals)["series"][curve]["v"])
      if (v.is_number()) sum += std::pow(v.get<double>(), 2), ++count;
    for (const json& run : model["runs"]) {
      if (run["file"] != wave + "step_a.csv") continue;
      // The motion is estimated again: see ShowsEveryResultOfTheChain; within 5 % the two models (a factor of eight apart) cannot be taken for one another.
      EXPECT_NEAR(std::sqrt(sum / count) / run["rms_residual"].get<double>(), 1, 0.05) << curve;
    }
  }
}

TEST(ReportOfADiagnosis, ShowsADiagnosisOfTheMandatoryFieldsAlone) {
  const TemporaryDirectory directory;
  json nothing = {{"unrig", "diagnosis"}, {"mismatch", {{"found", false}, {"p_value", 0.4}, {"runs", json::array()}, {"time", json::array()}, {"frequency", json::array()}, {"summary", ""}}},
                  {"missing", json::array()}, {"equivalent", json::array()}, {"unexplained", false}, {"improvement", {{"bic_before", 1}, {"bic_after", 1}, {"runs", json::array()}}}};
  const std::string output = directory.path("report.html");
  ASSERT_EQ(run_unrig(directory, {"report", directory.file("diagnosis.json", nothing.dump()), "-o", output}).status, 0);
  EXPECT_EQ(page_data(output)["verdicts"][0]["text"], "Nothing is missing: the rig model explains these recordings (p = 0.4).");
  nothing["verdict"] = "All is explained.";
  ASSERT_EQ(run_unrig(directory, {"report", directory.file("diagnosis.json", nothing.dump()), "-o", output}).status, 0);
  EXPECT_EQ(page_data(output)["verdicts"][0]["text"], "All is explained.");
  nothing.erase("verdict");
  nothing["mismatch"]["found"] = true;
  ASSERT_EQ(run_unrig(directory, {"report", directory.file("diagnosis.json", nothing.dump()), "-o", output}).status, 0);
  EXPECT_EQ(page_data(output)["verdicts"][0]["text"], "Something is missing (p = 0.4), and no known effect explains it.");
}

TEST(ReportOfADiagnosis, SaysWhichRecordingsItDoesNotFindAndFindsThemInAFolder) {
  const TemporaryDirectory directory;
  make_results(directory);
  json fit = json::parse(read_text(directory.path("fit.json")));
  fit["rig"] = "gone/rig.toml";
  for (json& run : fit["runs"]) run["file"] = "gone/" + std::filesystem::path(run["file"].get<std::string>()).filename().string();
  const std::string moved = directory.file("moved.json", fit.dump()), output = directory.path("report.html");
  const Finished without = run_unrig(directory, {"report", moved, "-o", output});
  EXPECT_EQ(without.status, 0);
  EXPECT_THAT(without.err, HasSubstr("gone/rig.toml"));
  EXPECT_TRUE(blocks(page_data(output), "plot").empty());
  const Finished with = run_unrig(directory, {"report", moved, "--data", test::null_campaign(""), "-o", output});
  EXPECT_THAT(with.err, IsEmpty());
  EXPECT_EQ(blocks(page_data(output), "plot").size(), 3u * 5 + 2 + 4);  // per run recording, residual, spectra, autocorrelation, quantiles; the step's angle twice more; response, phase and two shapes of the rig
}

TEST(ReportOfADiagnosis, SaysWhereARecordingIsNotTheOneThatWasFitted) {
  const TemporaryDirectory directory;
  make_results(directory);
  json fit = json::parse(read_text(directory.path("fit.json")));
  const std::filesystem::path original = fit["runs"][0]["file"].get<std::string>();
  const std::string name = original.filename().string(), output = directory.path("report.html");
  std::string text = read_text(original.string());
  directory.file(name, text);
  fit["runs"][0]["file"] = directory.path(name);
  const std::string moved = directory.file("moved.json", fit.dump());
  EXPECT_THAT(run_unrig(directory, {"report", moved, "-o", output}).err, IsEmpty()) << "the same readings elsewhere";
  const std::size_t last = text.find_last_of("123456789");
  text[last] = text[last] == '1' ? '2' : '1';
  directory.file(name, text);
  const Finished changed = run_unrig(directory, {"report", moved, "-o", output});
  EXPECT_EQ(changed.status, 0);
  EXPECT_THAT(changed.err, HasSubstr(name + "\" has other readings"));
  EXPECT_THAT(read_text(output), HasSubstr("has other readings"));
}

TEST(ReportOfADiagnosis, TellsALawThatWasFound) {
  const TemporaryDirectory directory;
  json diagnosis = made_up_diagnosis();
  diagnosis["missing"] = {{{"effect", "law"}, {"class", "damping"}, {"probability", 0.99}, {"equation", "not shown"}, {"parameters", {{{"name", "law.c"}, {"value", 1.23}, {"std_error", 0.02}, {"unit", "N"}}, {{"name", "law.p"}, {"value", 1.93}, {"std_error", 0.04}, {"unit", "1"}}}},
                           {"law", {{"acts_on", "normal"}, {"class", "damping"}, {"force", "-c * abs(v)^p * sign(v)"}, {"memory", "v - z"}, {"learnt_on", {{"v", {-0.31, 0.28, "m/s"}}}},
                                    {"rivals", {{{"force", "-c * v"}, {"distance_sigma", 14.2}, {"log_odds", 210.5}}, {{"force", "-c * v^3"}, {"distance_sigma", 3.1}, {"log_odds", 20.0}}}}}}}};
  const std::string output = directory.path("report.html");
  ASSERT_EQ(run_unrig(directory, {"report", directory.file("law.json", diagnosis.dump()), "-o", output}).status, 0);
  const json data = page_data(output);
  const std::vector<json> equations = blocks(data, "equation");
  ASSERT_EQ(equations.size(), 2u);
  EXPECT_EQ(equations[0]["text"], "F = -c * abs(v)^p * sign(v)");
  EXPECT_EQ(equations[1]["text"], "z' = v - z");
  EXPECT_THAT(blocks(data, "text")[1]["text"].get<std::string>(), ::testing::AllOf(HasSubstr("damping"), HasSubstr("calibration element")));
  std::map<std::string, json> rows;
  for (const json& table : blocks(data, "table")) rows[table["title"]] = table["rows"];
  EXPECT_EQ(rows["Learnt on"], json::parse(R"([["v", "-0.31", "0.28", "m/s"]])"));
  EXPECT_EQ(rows["Rivals of the law"], json::parse(R"([["-c * v", "14.2", "210.5"], ["-c * v^3", "3.1", "20"]])"));
  EXPECT_EQ(rows["Parameters of what was missing"][0], json::parse(R"(["law", "law.c", "1.230 ± 0.020", "N"])"));
  EXPECT_EQ(rows["Parameters of what was missing"][1][2], "1.930 ± 0.040");
}

}  // namespace
}  // namespace unrig
