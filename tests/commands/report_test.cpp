// `unrig report`: what stands in the page for each kind of result, and what it refuses. How a browser shows it: report_browser_test.cpp.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <regex>

#include <fmt/format.h>

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

TEST(Report, ShowsEveryResultOfTheChain) {
  const TemporaryDirectory directory;
  make_results(directory);
  const std::string output = directory.path("report.html");
  const Finished finished = run_unrig(directory, {"report", directory.path("fit.json"), directory.path("apparent.json"), directory.path("corrected.csv"), directory.path("indicial.csv"), "-o", output});
  ASSERT_EQ(finished.status, 0) << finished.err;
  EXPECT_THAT(finished.err, IsEmpty());
  const json data = page_data(output);
  EXPECT_EQ(data["verdicts"].size(), 4u);
  EXPECT_THAT(data["verdicts"][0]["text"].get<std::string>(), HasSubstr("3 of 3 recordings"));

  // The residual under the recording, in the same group, with the residual that fit.json reports.
  const json fit = json::parse(read_text(directory.path("fit.json")));
  std::size_t residuals = 0;
  for (const json& run : fit["runs"])
    for (const json& block : data["blocks"]) {
      if (block["type"] != "plot" || block["group"] != run["file"] || block["title"] != "gauge: residual") continue;
      ++residuals;
      // The page draws a band of two of these to either side, and the caption says of what.
      const double noise = block["series"][1]["std"][0];
      EXPECT_EQ(block["caption"], fmt::format("The band is twice the channel's own noise of {:.3g} N, to either side.", noise));
      double sum = 0;
      std::size_t count = 0;
      for (const json& v : block["series"][0]["v"])
        if (v.is_number()) sum += std::pow(v.get<double>(), 2), ++count;
      // The motion is estimated again with nearly the same windows and spikes: r.m.s. within a standard deviation of its own, 1/sqrt(2 n).
      EXPECT_NEAR(std::sqrt(sum / static_cast<double>(count)) / run["rms_residual"].get<double>(), 1, 1 / std::sqrt(2.0 * static_cast<double>(count)));
    }
  EXPECT_EQ(residuals, 3u);

  for (const json& plot : blocks(data, "plot")) {
    EXPECT_THAT(plot["x_label"].get<std::string>(), HasSubstr("[")) << "no unit on the axis of " << plot["title"];
    for (const json& series : plot["series"]) EXPECT_EQ(series["v"].size(), plot["x"].size());
  }
  const json* indicial = plot_titled(data, "Indicial response against Wagner's");
  ASSERT_TRUE(indicial);
  EXPECT_TRUE((*indicial)["series"][0].contains("std"));
  EXPECT_EQ((*indicial)["series"][1]["name"], "Wagner (exact)");
  ASSERT_TRUE(plot_titled(data, "Spectra of the free decays"));
  EXPECT_EQ((*plot_titled(data, "Spectra of the free decays"))["marks"].size(), 2u);
  const json* load = plot_titled(data, "Gauge and the load of a rigid rig");
  ASSERT_TRUE(load);
  // The inertial load goes far beyond the scale, which is the gauge's and the circulatory load's.
  ASSERT_TRUE(load->contains("y_range"));
  double largest = 0, largest_reading = 0;
  for (const json& v : (*load)["series"][1]["v"]) largest = std::max(largest, v.get<double>());
  for (const json& v : (*load)["series"][0]["v"]) largest_reading = std::max(largest_reading, v.get<double>());
  EXPECT_GT(largest, 2 * (*load)["y_range"][1].get<double>());
  EXPECT_GT((*load)["y_range"][1], largest_reading);

  // Spectra end behind the last mode, each marked: the modes of the water pluck are those that apparent-mass finds in it.
  const json* spectra = plot_titled(data, "Spectra before and after the correction");
  ASSERT_TRUE(spectra && spectra->contains("marks"));
  EXPECT_EQ((*spectra)["log_x"], true);
  EXPECT_LE((*spectra)["x"].back().get<double>(), 1.31 * (*spectra)["marks"].back()["x"].get<double>());
  const double wet = json::parse(read_text(directory.path("apparent.json")))["wet"]["frequency"];
  for (const json& block : data["blocks"])
    if (block["type"] == "plot" && block["title"] == "gauge: spectra before and after") {
      ASSERT_TRUE(block.contains("marks"));
      EXPECT_GE(block["marks"].size(), 4u);
    }
  // The head: the tow tank's numbers by hand, U c rho / mu and pi f c / U, in still water.
  const json head = data["head"], runs = head["conditions"]["rows"];
  ASSERT_EQ(runs.size(), 3u) << "the corrected step is one of the fit's: it is told once";
  EXPECT_EQ(runs[2][1], "step");
  constexpr double chord = 6 * 0.0254, speed = 0.6096;
  EXPECT_NEAR(std::stod(runs[2][6].get<std::string>()), speed * chord * 998.2 / 1.0016e-3, 100);
  EXPECT_NEAR(std::stod(runs[2][5].get<std::string>()), 3.14159265 * wet * chord / speed, 0.006);
  EXPECT_EQ(head["rigs"].size(), 1u);
  EXPECT_EQ(head["made"].size(), 3u) << "fit, apparent-mass, correct, each once";
  EXPECT_EQ(head["date"].get<std::string>().size(), std::string("2026-01-01").size());
}

TEST(Report, ShowsTheIndicialResponsesOfSeveralStepsTogether) {
  const TemporaryDirectory directory;
  const std::string header = "semichords,indicial,indicial_std\n", output = directory.path("report.html");
  const std::string one = directory.file("one.csv", header + "0.5,0.5,0.01\n1,0.6,0.01\n2,0.8,0.01\n"), two = directory.file("two.csv", header + "1,0.6,0.02\n3,0.8,0.04\n");
  ASSERT_EQ(run_unrig(directory, {"report", one, two, "-o", output}).status, 0);
  const json data = page_data(output);
  const json* plot = plot_titled(data, "Indicial responses of all steps");
  ASSERT_TRUE(plot);
  EXPECT_EQ((*plot)["x"], json({0.5, 1.0, 2.0, 3.0}));
  EXPECT_EQ((*plot)["series"][0]["v"], json::parse("[0.5, 0.6, 0.8, null]"));
  EXPECT_EQ((*plot)["series"][1]["v"], json::parse("[null, 0.6, 0.7, 0.8]")) << "straight lines between points, and nothing beyond them";
  EXPECT_EQ((*plot)["series"][1]["std"], json::parse("[null, 0.02, 0.03, 0.04]"));
  ASSERT_EQ(run_unrig(directory, {"report", one, "-o", output}).status, 0);
  EXPECT_FALSE(plot_titled(page_data(output), "Indicial responses of all steps"));
}

/// A mode of 5 Hz on a mount that is shaken, which reads 1000 N/m, under a load that steps from 0 to `load` [N] half-way.
constexpr int shaken_samples = 800;
std::string shaken(double load) {
  constexpr double dt = 0.005, w = 2 * 3.14159265358979 * 5;
  std::string run = "# unrig_run = 1\n# kind = \"moved\"\n# density = \"1.2 kg/m^3\"\n# speed = \"0 m/s\"\ntime [s],mount_acceleration [m/s^2],gauge [N]\n";
  double x = 0, v = 0;
  std::uint32_t random = 1;
  for (int k = 0; k < shaken_samples; ++k) {
    const double mount = std::sin(11 * k * dt);
    random = 1664525 * random + 1013904223;
    run += fmt::format("{:.3f},{:.6f},{:.6f}\n", k * dt, mount, 1000 * x + 0.01 * (static_cast<double>(random) / 4294967296.0 - 0.5));
    constexpr int fine = 20;
    for (int i = 0; i < fine; ++i) v += dt / fine * ((k < shaken_samples / 2 ? 0 : load) - mount - w * w * x - 2 * 0.02 * w * v), x += dt / fine * v;
  }
  return run;
}

TEST(Report, ShowsALoadOnARigThatIsKnownOnlyAsModes) {
  const TemporaryDirectory directory;
  const std::string rig = directory.file("rig.toml", "unrig_rig = 1\nname = \"spring\"\n[[modal]]\nmass = \"1 kg\"\nfrequency = \"5 Hz\"\ndamping_ratio = 0.02\ngauge_gain = \"1000 N/m\"\n");
  const std::string fit = directory.path("fit.json"), corrected = directory.path("corrected.csv"), output = directory.path("report.html");
  for (const std::vector<std::string>& command : std::vector<std::vector<std::string>>{{"fit", "--rig", rig, directory.file("empty.csv", shaken(0)), "-o", fit},
                                                                                       {"correct", "--rig", rig, "--fit", fit, directory.file("loaded.csv", shaken(1)), "-o", corrected},
                                                                                       {"report", corrected, "-o", output}}) {
    const Finished finished = run_unrig(directory, command);
    ASSERT_EQ(finished.status, 0) << finished.err;
  }
  const json data = page_data(output);
  EXPECT_THAT(data["verdicts"][0]["text"].get<std::string>(), ::testing::AllOf(HasSubstr("rigid rig"), HasSubstr("measured inputs account for")));
  const json* plot = plot_titled(data, "Gauge and the load of a rigid rig");
  ASSERT_TRUE(plot);
  EXPECT_EQ((*plot)["x"].size(), static_cast<std::size_t>(shaken_samples));
  EXPECT_TRUE((*plot)["series"][1].contains("std"));
  EXPECT_EQ((*plot)["y_label"], "reading [N]");
  ASSERT_TRUE(plot_titled(data, "Gauge and what the measured inputs do to it"));
  ASSERT_TRUE(plot_titled(data, "The load alone"));
  ASSERT_TRUE(plot_titled(data, "Spectra before and after the correction"));
}

TEST(Report, ACorrectionThatIsWrongGetsNoTick) {
  const TemporaryDirectory directory;
  make_results(directory);
  // Friction acts in this campaign; the fit knows of none.
  const std::string run = test::source_path("sample_data/campaigns/friction/step_a.csv"), corrected = directory.path("wrong.csv"), indicial = directory.path("wrong_indicial.csv");
  const Finished finished = run_unrig(directory, {"correct", "--rig", test::null_campaign("rig.toml"), "--fit", directory.path("fit.json"), run, "-o", corrected, "--indicial", indicial});
  ASSERT_EQ(finished.status, 0) << finished.err;
  ASSERT_THAT(finished.err, HasSubstr("Something is missing from the rig of the fit"));
  const std::string output = directory.path("report.html");
  ASSERT_EQ(run_unrig(directory, {"report", corrected, indicial, "-o", output}).status, 0);
  const json data = page_data(output);
  for (const json& verdict : data["verdicts"]) {
    EXPECT_EQ(verdict["tone"], "bad") << verdict;
    EXPECT_THAT(verdict["text"].get<std::string>(), ::testing::StartsWith("Something is missing from the rig of the fit: gauge and angle are explained to a reduced chi-square of ")) << verdict;
  }
  std::size_t warnings = 0;
  for (const json& text : blocks(data, "text")) warnings += text["text"].get<std::string>().find("Something is missing from the rig of the fit") != std::string::npos ? 1 : 0;
  EXPECT_EQ(warnings, 2u) << "one in each section";
  const json* residual = plot_titled(data, "Residual of the gauge");
  ASSERT_TRUE(residual);
  EXPECT_EQ((*residual)["group"], (*plot_titled(data, "Gauge and the load of a rigid rig"))["group"]) << "zooms with the load";
}

TEST(Report, TheToneOfACorrectionFollowsItsWarnings) {
  const TemporaryDirectory directory;
  const std::string columns = "time [s],semichords,gauge [N],normal_force [N],normal_force_std [N],circulatory [N],circulatory_std [N],cn,cn_std";
  const std::vector<std::array<std::string, 4>> tables{{",reduced_chi2", ",1.02", ",1.02", "good"},
                                                       {",reduced_chi2,warning: a.csv: 3 samples are missing", ",1.02,1", ",1.02,1", "open"},
                                                       {",reduced_chi2,no answer: a.csv: it moves.", ",1.02,1", ",1.02,1", "bad"},
                                                       {",reduced_chi2", ",60", ",60", "bad"},
                                                       {"", "", "", "open"}};
  for (const auto& [header, first, second, tone] : tables) {
    const std::string file = directory.file("corrected.csv", columns + header + "\n0,0,1,1,0.1,1,0.1,1,0.1" + first + "\n1,1,1,1,0.1,1,0.1,1,0.1" + second + "\n"), output = directory.path("report.html");
    ASSERT_EQ(run_unrig(directory, {"report", file, "-o", output}).status, 0);
    EXPECT_EQ(page_data(output)["verdicts"][0]["tone"], tone) << header << first;
  }
}

TEST(Report, TheIndicialResponseIsComparedWithWagnersByTheBandOfTheWholeCurve) {
  const TemporaryDirectory directory;
  // Wagner's function is near (s + 2)/(s + 4) (Garrick, within 2 %): 0.556 at 0.5 and 0.600 at 1 semichord. Two standard deviations hold one of the two, the band of the whole both.
  const std::string file = directory.file("indicial.csv", "semichords,indicial,indicial_std,indicial_band95,reduced_chi2\n0.5,0.556,0.01,0.03,1\n1,0.625,0.01,0.03,1\n"), output = directory.path("report.html");
  ASSERT_EQ(run_unrig(directory, {"report", file, "-o", output}).status, 0);
  const json agrees = page_data(output);
  EXPECT_EQ(agrees["verdicts"][0]["tone"], "good") << agrees["verdicts"][0];
  EXPECT_EQ(agrees["blocks"][1]["series"][0]["std"][0], 0.015) << "the page draws two of these to either side";
  ASSERT_EQ(run_unrig(directory, {"report", directory.file("indicial.csv", "semichords,indicial,indicial_std\n0.5,0.556,0.01\n1,0.625,0.01\n"), "-o", output}).status, 0);
  const json departs = page_data(output);
  EXPECT_EQ(departs["verdicts"][0]["tone"], "open");
  EXPECT_THAT(departs["verdicts"][0]["text"].get<std::string>(), HasSubstr("over 50 % of the points"));
}

TEST(Report, AnApparentMassThatIsNotConfirmedGetsNoTick) {
  const TemporaryDirectory directory;
  make_results(directory);
  const json sound = json::parse(read_text(directory.path("apparent.json")));
  const std::string output = directory.path("report.html"), rig = sound["rig"];
  const auto tone = [&](const json& result) {
    EXPECT_EQ(run_unrig(directory, {"report", directory.file("changed.json", result.dump()), "--data", test::null_campaign(""), "-o", output}).status, 0);
    return page_data(output)["verdicts"][0]["tone"].get<std::string>();
  };
  EXPECT_EQ(tone(sound), "good") << "what is warned of the rig file holds for every result";
  json warned = sound;
  warned["warnings"] = {rig + ":18: a line of the rig file", "wet_pluck.csv: the lowest mode does not decay exponentially"};
  EXPECT_EQ(tone(warned), "open");
  EXPECT_THAT(blocks(page_data(output), "text")[1]["text"].get<std::string>(), HasSubstr("does not decay exponentially"));
  json joint = sound;
  joint["joint_fit"] = {{"value", 1.1}, {"std_error", 0.3}, {"unit", "1"}, {"converged", true}, {"reduced_chi2", 2230.0}, {"agrees", false}};
  EXPECT_EQ(tone(joint), "open");
  joint["joint_fit"]["agrees"] = true;
  EXPECT_EQ(tone(joint), "good");
}

TEST(Report, WritesAnErrorWithThePowerOfItsValue) {
  const TemporaryDirectory directory;
  make_results(directory);
  json fit = json::parse(read_text(directory.path("fit.json")));
  fit["runs"] = json::array();  // only the table is looked at: no rig has such numbers
  const std::vector<std::array<double, 2>> values{{2.48411e6, 5300}, {1.1219, 0.0002}, {-1.1236e8, 1.3e4}, {3, 250}, {1e-15, 2e-17}};
  for (std::size_t k = 0; k < values.size(); ++k) fit["parameters"][k]["value"] = values[k][0], fit["parameters"][k]["std_error"] = values[k][1];
  const std::string output = directory.path("report.html");
  ASSERT_EQ(run_unrig(directory, {"report", directory.file("large.json", fit.dump()), "-o", output}).status, 0);
  std::vector<std::string> written;
  const std::vector<json> tables = blocks(page_data(output), "table");
  for (const json& row : tables[0]["rows"]) written.push_back(row[2]);
  EXPECT_THAT(written, ::testing::IsSupersetOf({"(2.4841 ± 0.0053)e6", "1.12190 ± 0.00020", "(-1.12360 ± 0.00013)e8", "(0.0 ± 2.5)e2", "(1.000 ± 0.020)e-15"}));
}

TEST(Report, ShowsASimulatedRunBesideItsRecording) {
  const TemporaryDirectory directory;
  make_results(directory);
  const std::string simulated = directory.path("simulated.csv"), output = directory.path("report.html");
  ASSERT_EQ(run_unrig(directory, {"simulate", "--rig", test::null_campaign("rig.toml"), "--fit", directory.path("fit.json"), "--run", test::null_campaign("step_a.csv"), "-o", simulated}).status, 0);
  ASSERT_EQ(run_unrig(directory, {"report", simulated, "-o", output}).status, 0);
  const json data = page_data(output);
  EXPECT_EQ(data["verdicts"][0]["tone"], "good") << "it was fitted: the two differ by the noise. " << data["verdicts"][0];
  const json *both = plot_titled(data, "gauge: recording and simulation"), *apart = plot_titled(data, "gauge: difference");
  ASSERT_TRUE(both && apart);
  const json recorded = (*both)["series"][0]["v"], model = (*both)["series"][1]["v"], difference = (*apart)["series"][0]["v"];
  for (std::size_t k = 0; k < difference.size(); k += 100) EXPECT_NEAR(difference[k].get<double>(), recorded[k].get<double>() - model[k].get<double>(), 1e-4);  // six digits of 10 N, twice
  EXPECT_TRUE(plot_titled(data, "circulatory: simulated")) << "which no one recorded";

  // A recording that is no longer there, and a run that says of no recording.
  std::string text = read_text(simulated);
  const std::string from = "simulated from the run ";
  text.replace(text.find(from) + from.size(), 1, "gone/");
  const Finished without = run_unrig(directory, {"report", directory.file("moved.csv", text), "-o", output});
  EXPECT_EQ(without.status, 0);
  EXPECT_THAT(without.err, HasSubstr("step_a.csv\" is not found"));
  EXPECT_EQ(page_data(output)["verdicts"][0]["tone"], "told");
  EXPECT_TRUE(plot_titled(page_data(output), "gauge: simulated"));
}

TEST(Report, ShowsATrial) {
  const TemporaryDirectory directory;
  const auto trial = [](std::vector<std::string> hidden, std::vector<std::string> found, bool right, bool unexplained) { return json{{"hidden", hidden}, {"found", found}, {"right", right}, {"unexplained", unexplained}}; };
  json result = {{"unrig", "trial"}, {"seed", 7}, {"noise", {{"gauge", 0.03}, {"unit", "N"}}}, {"recordings", {"a/step_a.csv"}}, {"nulls", 1}, {"false_alarms", 0}, {"wrong_names", 0}, {"misses", 2},
                 {"confusion", {{"nothing", {{"nothing", 1}}}, {"tank-wave", {{"tank-wave", 1}, {"nothing", 1}, {"unexplained", 1}}}}},
                 {"effects", {{{"effect", "tank-wave"}, {"hidden", 3}, {"found", 1}, {"equivalent", 0}, {"smallest_found", 4.5}, {"found_nine_in_ten_from", nullptr}}}},
                 {"trials", {trial({}, {}, true, false), trial({"tank-wave"}, {"tank-wave"}, true, false), trial({"tank-wave"}, {}, false, false), trial({"tank-wave"}, {}, false, true)}}};
  const std::string output = directory.path("report.html");
  ASSERT_EQ(run_unrig(directory, {"report", directory.file("trial.json", result.dump()), "-o", output}).status, 0);
  const json data = page_data(output);
  EXPECT_EQ(data["verdicts"][0]["text"],
            "Of 3 campaigns that hid something 1 was named right, 0 named an effect that was not there, 1 called unexplained and 1 not seen; no false alarm in 1 campaign that hid nothing.");
  EXPECT_EQ(data["verdicts"][0]["tone"], "good");
  const std::vector<json> tables = blocks(data, "table");
  EXPECT_EQ(tables[0]["header"], json({"hidden", "nothing", "tank-wave", "unexplained"}));
  EXPECT_EQ(tables[0]["rows"][1], json({"tank-wave", "1", "1", "1"}));
  EXPECT_EQ(tables[1]["rows"][0], json({"tank-wave", "1", "3", "0", "4.5", "—"}));
  // Wilson's interval of 1 of 3 is 6.15 to 79.23 %, of 0 of 1 it is 0 to 79.35 % (Agresti and Coull, American Statistician 52 (1998) 119, give the formula).
  const std::vector<json> bars = blocks(data, "bars");
  ASSERT_EQ(bars.size(), 1u);
  ASSERT_EQ(bars[0]["rows"].size(), 2u);
  EXPECT_NEAR(bars[0]["rows"][0]["low"].get<double>(), 0.0615, 1e-4);
  EXPECT_NEAR(bars[0]["rows"][0]["high"].get<double>(), 0.7923, 1e-4);
  EXPECT_EQ(bars[0]["rows"][1]["name"], "false alarm");
  EXPECT_NEAR(bars[0]["rows"][1]["low"].get<double>(), 0, 1e-12);
  EXPECT_NEAR(bars[0]["rows"][1]["high"].get<double>(), 0.7935, 1e-4);
  result["false_alarms"] = 1;
  ASSERT_EQ(run_unrig(directory, {"report", directory.file("trial.json", result.dump()), "-o", output}).status, 0);
  EXPECT_EQ(page_data(output)["verdicts"][0]["tone"], "open");
}

TEST(Report, StacksTheErrorBudgetOfALoad) {
  const TemporaryDirectory directory;
  make_results(directory);
  const std::string output = directory.path("report.html");
  ASSERT_EQ(run_unrig(directory, {"report", directory.path("corrected.csv"), "-o", output}).status, 0);
  const json data = page_data(output);
  for (const char* load : {"circulatory load", "load of a rigid rig"}) {
    const json* plot = plot_titled(data, std::string("Error budget of the ") + load);
    ASSERT_NE(plot, nullptr) << load;
    EXPECT_TRUE(plot->at("stacked").get<bool>());
    for (std::size_t k = 0; k < (*plot)["x"].size(); ++k) {
      double sum = 0;
      for (const json& series : (*plot)["series"]) sum += series["v"][k].get<double>();
      ASSERT_NEAR(sum, 1, 6 * 5e-4) << "of six sources one that is below 0.05 % throughout is left out";
    }
  }
}

TEST(Report, DrawsTheRigOfACheck) {
  const TemporaryDirectory directory;
  const std::string rig = test::null_campaign("rig.toml"), checked = directory.path("check.json"), output = directory.path("report.html");
  ASSERT_EQ(run_unrig(directory, {"check", "--rig", rig, test::null_campaign("wet_pluck.csv"), test::null_campaign("step_a.csv"), "-o", checked}).status, 0);
  ASSERT_EQ(run_unrig(directory, {"report", checked, "-o", output}).status, 0);
  const json data = page_data(output);
  EXPECT_EQ(data["verdicts"][0]["tone"], "good");
  const json* drawing = plot_titled(data, "The rig");
  ASSERT_NE(drawing, nullptr);
  EXPECT_EQ((*drawing)["marks"].size(), 2u) << "gauge and calibration";
  const json* shapes = plot_titled(data, "Mode shapes: displacement");
  ASSERT_NE(shapes, nullptr);
  EXPECT_THAT((*shapes)["series"][0]["name"].get<std::string>(), HasSubstr("7.743 Hz")) << "as `unrig check` prints it in vacuum";

  // A wrong run is the verdict; without its rig the page says so.
  const std::string text = read_text(test::null_campaign("step_a.csv"));
  const std::string bad = directory.file("step_a.csv", std::regex_replace(text, std::regex("gauge \\[N\\]"), "gauge [lbf]")), copy = directory.file("rig.toml", read_text(rig));
  ASSERT_EQ(run_unrig(directory, {"check", "--rig", copy, test::null_campaign("wet_pluck.csv"), bad, "-o", checked}).status, 1);
  std::filesystem::remove(copy);
  ASSERT_EQ(run_unrig(directory, {"report", checked, "-o", output}).status, 0);
  const json wrong = page_data(output);
  EXPECT_EQ(wrong["verdicts"][0]["tone"], "bad");
  EXPECT_THAT(wrong["verdicts"][0]["text"].get<std::string>(), HasSubstr("lbf"));
  EXPECT_EQ(plot_titled(wrong, "The rig"), nullptr);
  EXPECT_THAT(wrong.dump(), HasSubstr("is no longer there"));
}

TEST(Report, RefusesWhatIsNoResult) {
  const TemporaryDirectory directory;
  json bad_diagnosis = made_up_diagnosis();
  bad_diagnosis["improvement"]["runs"][0]["heldout"] = "no";
  const std::vector<std::pair<std::string, std::string>> bad{
      {directory.path("absent.json"), "cannot be read"},
      {directory.file("empty.json", ""), "neither JSON"},
      {directory.file("cut.json", "{\"unrig\": \"fit\", "), "not valid JSON"},
      {directory.file("list.json", "{}"), "no key"},
      {directory.file("kind.json", "{\"unrig\": \"supper\"}"), "supper"},
      {directory.file("fit.json", "{\"unrig\": \"fit\"}"), "parameters"},
      {directory.file("apparent.json", "{\"unrig\": \"apparent-mass\"}"), "apparent_mass"},
      {directory.file("diagnosis.json", "{\"unrig\": \"diagnosis\"}"), "mismatch"},
      {directory.file("trial.json", "{\"unrig\": \"trial\"}"), "trials"},
      {directory.file("types.json", bad_diagnosis.dump()), "types.json"},
      {directory.file("indicial.csv", "semichords,indicial,indicial_std\n1,0.5,0.01\n0.5,0.6,0.01\n"), "indicial.csv:3"},
      {directory.file("corrected.csv", "time [s],normal_force_std [N]\n0,1\n1,2\n"), "gauge"},
      {directory.file("markup.csv", "time [s],gauge [N<img src=x onerror=alert(1)>],normal_force_std [N]\n0,1,2\n1,1,2\n"), "markup.csv:1: the column \"gauge\" has the unknown unit"},
      {test::null_campaign("step_a.csv"), "fit.json"}};
  for (const auto& [file, complaint] : bad) {
    const Finished finished = run_unrig(directory, {"report", file, "-o", directory.path("report.html")});
    EXPECT_EQ(finished.status, 2) << file;
    EXPECT_THAT(finished.err, HasSubstr(complaint)) << file;
    EXPECT_FALSE(std::filesystem::exists(directory.path("report.html"))) << file;
  }
}

}  // namespace
}  // namespace unrig
