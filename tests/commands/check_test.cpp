// `unrig check`, and the gate in fit, diagnose and correct: mistakes that people make are named by cause and run, and data that are right are not.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <functional>
#include <map>
#include <numbers>
#include <regex>
#include <sstream>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "core/files/text_file.h"
#include "tests/commands/run_unrig.h"
#include "tests/support/sample_data.h"

namespace unrig {
namespace {

using nlohmann::json;
using test::Finished;
using test::null_campaign;
using test::run_unrig;
using test::TemporaryDirectory;
using ::testing::HasSubstr;
using ::testing::Not;

using Change = std::function<std::string(const std::string&)>;

/// The text of a run file with each row of numbers changed.
std::string with_rows(const std::string& text, const std::function<void(std::vector<double>&)>& change) {
  std::istringstream lines(text);
  std::string out;
  for (std::string line; std::getline(lines, line);) {
    if (line.starts_with("#") || line.starts_with("time")) {
      out += line + "\n";
      continue;
    }
    std::istringstream cells(line);
    std::vector<double> row;
    for (std::string cell; std::getline(cells, cell, ',');) row.push_back(std::stod(cell));
    change(row);
    std::ostringstream written;
    written.precision(10);
    for (std::size_t i = 0; i < row.size(); ++i) written << (i ? "," : "") << row[i];
    out += written.str() + "\n";
  }
  return out;
}

constexpr std::size_t time_column = 0, alpha = 1, gauge = 2;

Change times(std::size_t column, double factor) {
  return [=](const std::string& text) { return with_rows(text, [=](std::vector<double>& row) { row[column] *= factor; }); };
}
Change replaced(const std::string& was, const std::string& is) {
  return [=](const std::string& text) { return std::regex_replace(text, std::regex(was), is); };
}
Change metadata(const std::string& key, const std::string& value) { return replaced("# " + key + " = .*", "# " + key + " = " + value); }
Change exchanged_columns() {
  return [](const std::string& text) { return with_rows(text, [](std::vector<double>& row) { std::swap(row[alpha], row[gauge]); }); };
}
std::string without_beginning(const std::string& text) {
  std::istringstream lines(text);
  std::string out;
  int row = 0;
  for (std::string line; std::getline(lines, line);)
    if (line.starts_with("#") || line.starts_with("time") || row++ >= 700) out += line + "\n";
  return out;
}

struct Mistake {
  const char* name;
  Change change;
  std::vector<std::string> runs;  ///< in which of them it is tried, each alone
  const char* cause;              ///< word that the line must hold
};

const std::vector<std::string> steps{"step_a", "step_b", "step_c"}, decays{"dry_pluck", "wet_pluck"}, all{"dry_pluck", "wet_pluck", "step_a", "step_b", "step_c"};

/// Those of the trial as a new user that a recording can show.
std::vector<Mistake> mistakes() {
  const double degrees = 180 / std::numbers::pi;
  return {
      {"degrees labelled rad", replaced("alpha \\[deg\\]", "alpha [rad]"), steps, "degrees"},
      {"radians labelled deg", times(alpha, 1 / degrees), steps, "radians"},
      {"sign of the angle", times(alpha, -1), steps, "sign of the angle"},
      {"sign of the gauge", times(gauge, -1), steps, "sign of the gauge"},
      {"columns exchanged", exchanged_columns(), all, "exchanged"},
      {"kN for N", replaced("gauge \\[N\\]", "gauge [kN]"), steps, "kN"},
      {"lbf for N", replaced("gauge \\[N\\]", "gauge [lbf]"), steps, "lbf"},
      {"ms written as s", times(time_column, 1000), all, "ms written as s"},
      {"clock twice too slow", times(time_column, 2), all, "twice too slow"},
      {"twice the speed", metadata("speed", "\"1.2192 m/s\""), {"step_a", "step_c"}, "twice the true speed"},
      {"ft/s written as m/s", metadata("speed", "\"2 m/s\""), {"step_a", "step_c"}, "ft/s"},
      {"water labelled air", metadata("density", "\"1.2 kg/m^3\""), {"wet_pluck", "step_a", "step_b", "step_c"}, "labelled air"},
      {"air labelled water", metadata("density", "\"998.2 kg/m^3\""), {"dry_pluck"}, "labelled water"},
      {"g/cc written as kg/m^3", metadata("density", "\"0.9982 kg/m^3\""), {"wet_pluck", "step_a", "step_b", "step_c"}, "g/cm\\^3"},
      {"a step labelled pluck", metadata("kind", "\"pluck\""), steps, "a step"},
      {"a decay labelled step", metadata("kind", "\"step\""), decays, "a free decay"},
      {"a record without its beginning", without_beginning, steps, "without its beginning"},
  };
}

class Check : public ::testing::Test {
 protected:
  /// The runs of the campaign, one or all of them changed.
  std::vector<std::string> campaign(const Change& change, const std::vector<std::string>& bad) {
    std::vector<std::string> files;
    for (const std::string& name : all) {
      const std::string path = null_campaign(name + ".csv");
      const bool is_bad = std::find(bad.begin(), bad.end(), name) != bad.end();
      files.push_back(is_bad ? directory.file(name + ".csv", change(read_text(path))) : path);
    }
    return files;
  }
  Finished unrig(std::vector<std::string> words, const std::vector<std::string>& files) {
    words.insert(words.end(), files.begin(), files.end());
    return run_unrig(directory, words);
  }
  Finished check(const std::vector<std::string>& files) { return unrig({"check", "--rig", null_campaign("rig.toml")}, files); }

  TemporaryDirectory directory;
};

TEST_F(Check, NamesCauseAndRunOfEveryMistakeInOneRun) {
  for (const Mistake& mistake : mistakes())
    for (const std::string& bad : mistake.runs) {
      const Finished finished = check(campaign(mistake.change, {bad}));
      EXPECT_EQ(finished.status, 1) << mistake.name << " in " << bad << "\n" << finished.err;
      EXPECT_THAT(finished.err, ::testing::ContainsRegex("check: " + bad + ".csv: .*" + mistake.cause)) << mistake.name << " in " << bad;
    }
}

TEST_F(Check, NamesTheCauseWhereAllRunsHaveIt) {
  for (const Mistake& mistake : mistakes()) {
    if (std::string(mistake.name).starts_with("a ") || mistake.runs.size() < 3 || std::string(mistake.cause) == "labelled air" || std::string(mistake.name).starts_with("g/cc")) continue;
    const Finished finished = check(campaign(mistake.change, mistake.runs));
    EXPECT_EQ(finished.status, 1) << mistake.name << "\n" << finished.err;
    EXPECT_THAT(finished.err, HasSubstr(mistake.cause)) << mistake.name;
  }
}

TEST_F(Check, NamesWhatIsWrongInTheRigFile) {
  const std::string text = read_text(null_campaign("rig.toml"));
  for (const auto& [was, is, cause] : {std::tuple{"chord = \"6 in\"", "chord = \"6 mm\"", "the chord in mm for in"}, std::tuple{"mass\\.unit = \"lb\"", "mass.unit = \"kg\"", "kg written for lb"},
                                       std::tuple{"normal\\]([^]*?)flexibility\\.scale = 1e-6", "normal]$1flexibility.scale = 1e-3", "1e-3 for 1e-6"}}) {
    const std::string rig = directory.file("rig.toml", std::regex_replace(text, std::regex(was), is, std::regex_constants::format_first_only));
    const Finished finished = unrig({"check", "--rig", rig}, campaign({}, {}));
    EXPECT_EQ(finished.status, 1) << cause << finished.err;
    EXPECT_THAT(finished.err, HasSubstr(std::string("check: rig.toml: "))) << cause;
    EXPECT_THAT(finished.err, HasSubstr(cause));
  }
}

TEST_F(Check, IsSilentAboutWhatIsHarmless) {
  const Change later = [](const std::string& text) { return with_rows(text, [](std::vector<double>& row) { row[gauge] += 50, row[alpha] += 5; }); };
  const Change milliseconds = [](const std::string& text) { return replaced("time \\[s\\]", "time [ms]")(times(time_column, 1000)(text)); };
  for (const Change& change : {later, milliseconds}) {
    const Finished finished = check(campaign(change, all));
    EXPECT_EQ(finished.status, 0) << finished.err;
    EXPECT_THAT(finished.err, Not(HasSubstr("check:")));
  }
}

TEST_F(Check, CountsClippedReadingsAndGoesOn) {
  const std::vector<std::string> files = campaign([](const std::string& text) { return with_rows(text, [](std::vector<double>& row) { row[gauge] = std::min(row[gauge], 25.0); }); }, {"wet_pluck"});
  const Finished finished = check(files);
  EXPECT_EQ(finished.status, 0) << finished.err;
  EXPECT_THAT(finished.err, ::testing::ContainsRegex("check: wet_pluck.csv: [0-9]+ of 2500 readings of the gauge are clipped"));
}

TEST_F(Check, NamesWhatAFitWouldRefuse) {
  for (const auto& [change, said] : {std::pair{replaced("alpha \\[deg\\]", "angle [deg]"), "step_a.csv:7: a step without a column \"alpha\"; there is a column \"angle\""},
                                     std::pair{replaced("gauge \\[N\\]", "gauge [V]"), "step_a.csv:7: the column \"gauge\" is in V"}}) {
    const Finished finished = check(campaign(change, {"step_a"}));
    EXPECT_EQ(finished.status, 1) << finished.err;
    EXPECT_THAT(finished.err, ::testing::ContainsRegex("check: .*step_a.csv:7")) << said;
    EXPECT_THAT(finished.err, HasSubstr(said));
  }
}

TEST_F(Check, NamesARecordThatIsNoRecord) {
  const Finished still = check(campaign([](const std::string& text) { return with_rows(text, [](std::vector<double>& row) { row[gauge] = 6.5; }); }, {"step_a"}));
  EXPECT_EQ(still.status, 1);
  EXPECT_THAT(still.err, HasSubstr("check: step_a.csv: 3000 of 3000 readings of the gauge are one and the same"));
  const Finished cut = check(campaign([](const std::string& text) { return text.substr(0, text.find("\n0.014,") + 1); }, {"step_a"}));
  EXPECT_EQ(cut.status, 0) << cut.err;
  EXPECT_THAT(cut.err, HasSubstr("check: step_a.csv: 7 samples, 0.014 s, are 0.041 periods of the rig"));
}

TEST_F(Check, StopsFitDiagnoseAndCorrectBeforeTheySearch) {
  const std::vector<std::string> files = campaign(times(gauge, 4.4482216152605), {"step_b"});
  const std::string out = directory.path("out.json");
  for (const char* command : {"fit", "diagnose"}) {
    const Finished finished = unrig({command, "--rig", null_campaign("rig.toml"), "-o", out}, files);
    EXPECT_EQ(finished.status, 1) << finished.err;
    EXPECT_THAT(finished.err, HasSubstr("check: step_b.csv: the gauge reads 4.448 times what the other runs say"));
    EXPECT_FALSE(std::filesystem::exists(out));
  }
  ASSERT_EQ(unrig({"fit", "--rig", null_campaign("rig.toml"), "-o", out}, campaign({}, {})).status, 0);
  const Finished corrected = unrig({"correct", "--rig", null_campaign("rig.toml"), "--fit", out, "-o", directory.path("c.csv")}, {files[3]});
  EXPECT_EQ(corrected.status, 1);
  EXPECT_THAT(corrected.err, HasSubstr("check: step_b.csv: the gauge reads 4.448 times"));
}

TEST_F(Check, LetsThosePassWhoKnowBetter) {
  const std::vector<std::string> files = campaign(times(gauge, 4.4482216152605), {"step_b"});
  const std::string fit = directory.path("fit.json"), out = directory.path("corrected.csv");
  ASSERT_EQ(unrig({"fit", "--rig", null_campaign("rig.toml"), "-o", fit}, campaign({}, {})).status, 0);
  const Finished finished = unrig({"correct", "--anyway", "--rig", null_campaign("rig.toml"), "--fit", fit, "-o", out}, {files[3]});
  EXPECT_THAT(finished.err, HasSubstr("check: step_b.csv: the gauge reads 4.448 times"));
  EXPECT_TRUE(std::filesystem::exists(out)) << "it was corrected all the same";
}

TEST_F(Check, WritesTheNumbersWithTheirUnits) {
  const std::string out = directory.path("check.json");
  const Finished finished = unrig({"check", "--rig", null_campaign("rig.toml"), "-o", out}, campaign({}, {}));
  ASSERT_EQ(finished.status, 0) << finished.err;
  const json checked = json::parse(read_text(out));
  EXPECT_EQ(checked["unrig"], "check");
  EXPECT_TRUE(checked["suspicions"].empty());
  EXPECT_NEAR(checked["rig"]["mass"]["value"], 7.868, 0.001) << "17.35 lb";
  EXPECT_EQ(checked["rig"]["deflection_per_newton"]["unit"], "m/N");
  EXPECT_NEAR(checked["rig"]["media"][0]["modes"][0]["frequency"], 7.743, 0.01);
  const double b = 0.0762, span = 3 * 0.3556;
  EXPECT_NEAR(checked["rig"]["media"][2]["apparent_mass"]["value"], std::numbers::pi * 998.2 * b * b * span, 0.01);
  ASSERT_EQ(checked["runs"].size(), 5u);
  const json& step = checked["runs"][2];
  EXPECT_EQ(step["samples"], 3000);
  EXPECT_NEAR(step["motion"]["step"]["value"], 1.3, 0.01) << step["motion"]["step"]["unit"];
  EXPECT_NEAR(step["channels"][1]["noise"], 0.0272, 0.002) << "KEY.json: 0.02724 N";
  for (const json& parameter : checked["determined"]) EXPECT_TRUE(parameter["determined"].get<bool>()) << parameter;
}

TEST_F(Check, SaysWhatADecayDoesNotDetermine) {
  const std::string rig = directory.file("modes.toml", "unrig_rig = 1\nname = \"oscillator\"\n[[modal]]\nmass = \"1 kg\"\nfrequency = \"5 Hz\"\ndamping_ratio = 0.01\ngauge_gain = \"1000 N/m\"\n");
  std::string decay = "# unrig_run = 1\n# kind = \"pluck\"\n# density = \"1.2 kg/m^3\"\n# speed = \"0 m/s\"\ntime [s],gauge [N]\n";
  for (int k = 0; k < 1000; ++k) {
    const double t = 0.005 * k, w = 2 * std::numbers::pi * 5;
    decay += std::to_string(t) + "," + std::to_string(10 * std::exp(-0.01 * w * t) * std::cos(w * t) + 0.01 * ((k * 7919) % 101 - 50) / 50.0) + "\n";
  }
  const std::string out = directory.path("check.json");
  const Finished finished = unrig({"check", "--rig", rig, "-o", out}, {directory.file("decay.csv", decay)});
  ASSERT_EQ(finished.status, 0) << finished.err;
  std::map<std::string, json> determined;
  const json checked = json::parse(read_text(out));
  for (const json& parameter : checked["determined"]) determined[parameter["name"].get<std::string>()] = parameter;
  EXPECT_FALSE(determined.at("modal[1].mass")["determined"].get<bool>()) << "a decay gives stiffness and damping per mass";
  EXPECT_THAT(determined.at("modal[1].mass")["advice"].get<std::string>(), HasSubstr("Record a run with a measured force"));
  EXPECT_TRUE(determined.at("modal[1].stiffness")["determined"].get<bool>());
}

TEST_F(Check, TakesARigAlone) {
  const Finished finished = unrig({"check", "--rig", null_campaign("rig.toml")}, {});
  EXPECT_EQ(finished.status, 0) << finished.err;
  EXPECT_THAT(finished.out, HasSubstr("in vacuum: 7.743 Hz"));
  EXPECT_THAT(finished.out, HasSubstr("apparent mass"));
}

TEST_F(Check, TakesARigOfModes) {
  const Finished finished = unrig({"check", "--rig", test::source_path("sample_data/impact/rig.toml")}, {test::source_path("sample_data/impact/hammer.csv")});
  EXPECT_EQ(finished.status, 0) << finished.err;
  EXPECT_THAT(finished.err, Not(HasSubstr("check:")));
}

}  // namespace
}  // namespace unrig
