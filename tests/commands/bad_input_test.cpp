// What every command does with input that cannot be used: one clear message with file, line, what was found and what was wanted; exit
// status 2; no output file made or touched.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "core/files/text_file.h"
#include "tests/commands/run_unrig.h"
#include "tests/support/replaced.h"
#include "tests/support/sample_data.h"

namespace unrig {
namespace {

using test::Finished;
using test::TemporaryDirectory;
using test::replaced;
using test::run_unrig;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> lines;
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t end = std::min(text.find('\n', at), text.size());
    lines.push_back(text.substr(at, end - at));
    at = end + 1;
  }
  return lines;
}

std::string joined(const std::vector<std::string>& lines) {
  std::string text;
  for (const std::string& line : lines) text += line + "\n";
  return text;
}

/// The text with line `number` (from 1) changed by `change`.
std::string with_line(const std::string& text, std::size_t number, const std::function<std::string(const std::string&)>& change) {
  std::vector<std::string> lines = lines_of(text);
  lines.at(number - 1) = change(lines.at(number - 1));
  return joined(lines);
}

std::string without_cell(const std::string& line, int cell, const std::string& by) {
  std::vector<std::string> cells{""};
  for (const char c : line)
    if (c == ',')
      cells.emplace_back();
    else
      cells.back() += c;
  cells.at(static_cast<std::size_t>(cell)) = by;
  std::string text = cells.front();
  for (std::size_t k = 1; k < cells.size(); ++k) text += "," + cells[k];
  return text;
}

// Both recordings have six lines of meta data, the header in line 7, and time, alpha, gauge below it.
const std::string& step() {
  static const std::string text = read_text(test::null_campaign("step_a.csv"));
  return text;
}
const std::string& decay() {
  static const std::string text = read_text(test::null_campaign("wet_pluck.csv"));
  return text;
}
const std::string& rig() {
  static const std::string text = read_text(test::null_campaign("rig.toml"));
  return text;
}

/// Calls every command that reads such a file with it, twice each: with an output file that exists, and with none.
class BadInput : public ::testing::Test {
 protected:
  BadInput() {
    rig_ = directory_.file("rig.toml", rig());
    step_ = directory_.file("step.csv", step());
    decay_ = directory_.file("decay.csv", decay());
    dry_ = test::null_campaign("dry_pluck.csv");
    fit_ = directory_.file("fit.json", R"({"unrig": "fit", "parameters": []})");
  }

  /// The message of all commands about an unusable step.
  void expect_refused_step(const std::string& text, const std::vector<std::string>& parts) {
    step_ = directory_.file("step.csv", text);
    refused({"fit", "--rig", rig_, decay_, step_}, parts);
    refused({"correct", "--rig", rig_, "--fit", fit_, step_}, parts);
    refused({"simulate", "--rig", rig_, "--run", step_}, parts);
  }
  void expect_refused_decay(const std::string& text, const std::vector<std::string>& parts) {
    decay_ = directory_.file("decay.csv", text);
    refused({"fit", "--rig", rig_, decay_}, parts);
    refused({"apparent-mass", "--rig", rig_, "--dry", dry_, "--wet", decay_}, parts);
  }
  void expect_refused_rig(const std::string& text, const std::vector<std::string>& parts) {
    rig_ = directory_.file("rig.toml", text);
    refused({"fit", "--rig", rig_, decay_}, parts);
    refused({"apparent-mass", "--rig", rig_, "--dry", dry_, "--wet", decay_}, parts);
    refused({"correct", "--rig", rig_, "--fit", fit_, step_}, parts);
    refused({"simulate", "--rig", rig_, "--run", step_}, parts);
  }

  void refused(std::vector<std::string> arguments, const std::vector<std::string>& parts) {
    const std::string output = directory_.path("output");
    arguments.insert(arguments.end(), {"-o", output});
    for (const bool exists : {true, false}) {
      std::filesystem::remove(output);
      if (exists) directory_.file("output", "what an earlier call found");
      const Finished finished = run_unrig(directory_, arguments);
      EXPECT_EQ(finished.status, 2) << finished.err;
      EXPECT_THAT(finished.out, IsEmpty());
      // One message; remarks about other files may stand before it.
      std::vector<std::string> messages = lines_of(finished.err);
      std::erase_if(messages, [](const std::string& line) { return line.starts_with("warning: "); });
      ASSERT_EQ(messages.size(), 1u) << finished.err;
      EXPECT_THAT(messages[0], HasSubstr("unrig " + arguments[0] + ": "));
      for (const std::string& part : parts) EXPECT_THAT(messages[0], HasSubstr(part));
      EXPECT_THAT(messages[0], HasSubstr("; wanted ")) << "what was found, and what was wanted";
      EXPECT_EQ(std::filesystem::exists(output), exists);
      if (exists) {
        EXPECT_EQ(test::whole_file(output), "what an earlier call found");
      }
    }
    // Nor is anything left beside it.
    for (const auto& entry : std::filesystem::directory_iterator(directory_.path(""))) EXPECT_THAT(entry.path().filename().string(), ::testing::Not(HasSubstr("tmp")));
  }

  TemporaryDirectory directory_;
  std::string rig_, step_, decay_, dry_, fit_;
};

TEST_F(BadInput, AbsentFile) {
  refused({"fit", "--rig", directory_.path("absent.toml"), decay_}, {"absent.toml", "No such file"});
  refused({"fit", "--rig", rig_, directory_.path("absent.csv")}, {"absent.csv", "No such file"});
  refused({"correct", "--rig", rig_, "--fit", directory_.path("absent.json"), step_}, {"absent.json", "No such file"});
}

TEST_F(BadInput, TruncatedFile) {
  const std::size_t end = step().find(',', step().find("\n2.000,") + 7) + 1;  // after the angle at 2 s, line 1008
  expect_refused_step(step().substr(0, end - 1), {"step.csv:1008: ", "in the middle of a row", "2 cells", "wanted 3"});
  std::vector<std::string> lines = lines_of(decay());
  lines.resize(6);
  expect_refused_decay(joined(lines), {"decay.csv:6: ", "ends after its meta data"});
}

TEST_F(BadInput, WrongHeader) {
  expect_refused_step(replaced(step(), "time [s],alpha [deg]", "time,alpha [deg]"), {"step.csv:7: ", "\"time\" has no unit"});
  expect_refused_step(replaced(step(), "time [s],alpha [deg],gauge [N]\n", ""), {"step.csv:7: ", "is no header"});
  expect_refused_decay(replaced(decay(), "gauge [N]", "alpha [N]"), {"decay.csv:7: ", "\"alpha\" more than once"});
  expect_refused_decay(replaced(decay(), "# unrig_run = 1\n", ""), {"decay.csv:1: ", "unrig_run = 1"});
}

TEST_F(BadInput, UnknownKey) {
  expect_refused_step(replaced(step(), "# speed =", "# sped ="), {"step.csv:6: ", "sped"});
  expect_refused_rig(replaced(rig(), "[section]\n", "[section]\nsweep = 3\n"), {"rig.toml:", "section.sweep"});
}

TEST_F(BadInput, UnitOfTheWrongDimension) {
  expect_refused_step(replaced(step(), "998.2 kg/m^3", "998.2 kg/m^2"), {"step.csv:5: ", "density", "kg/m^2", "kg/m^3"});
  expect_refused_step(replaced(step(), "alpha [deg]", "alpha [mm]"), {"step.csv:7: ", "alpha", "mm", "rad"});
  expect_refused_decay(replaced(decay(), "time [s]", "time [m]"), {"decay.csv:7: ", "time"});
  expect_refused_rig(replaced(rig(), "chord = \"6 in\"", "chord = \"6 lb\""), {"rig.toml:", "section.chord", "lb"});
}

TEST_F(BadInput, DecreasingTime) {
  std::vector<std::string> lines = lines_of(step());
  std::swap(lines[1000], lines[1010]);
  expect_refused_step(joined(lines), {"step.csv:1002: ", "the time falls from", "times that increase"});
}

TEST_F(BadInput, NotANumberInTime) {
  expect_refused_step(with_line(step(), 700, [](const std::string& line) { return without_cell(line, 0, "nan"); }), {"step.csv:700: ", "time"});
  expect_refused_decay(with_line(decay(), 50, [](const std::string& line) { return without_cell(line, 0, ""); }), {"decay.csv:50: ", "time"});
}

TEST_F(BadInput, AGapInTime) {
  std::vector<std::string> lines = lines_of(decay());
  lines.erase(lines.begin() + 300, lines.begin() + 320);
  expect_refused_decay(joined(lines), {"decay.csv:301: ", "gap"});
}

TEST_F(BadInput, AColumnWithoutANumber) {
  std::vector<std::string> lines = lines_of(decay());
  for (std::size_t k = 7; k < lines.size(); ++k) lines[k] = without_cell(lines[k], 2, "nan");
  expect_refused_step(with_line(step(), 99, [](const std::string& line) { return without_cell(line, 2, "overload"); }), {"step.csv:99: ", "overload"});
  expect_refused_decay(joined(lines), {"decay.csv:7: ", "\"gauge\" has no number", "2500"});
}

TEST_F(BadInput, SingleMissingReadingsAreLeftOutAndCounted) {
  std::string text = with_line(decay(), 100, [](const std::string& line) { return without_cell(line, 2, ""); });
  text = with_line(text, 1500, [](const std::string& line) { return without_cell(line, 2, "nan"); });
  decay_ = directory_.file("decay.csv", text);
  const Finished finished = run_unrig(directory_, {"fit", "--rig", rig_, decay_, "-o", directory_.path("out.json")});
  EXPECT_EQ(finished.status, 0) << finished.err;
  EXPECT_THAT(finished.out, HasSubstr("2 missing"));
  const auto fit = nlohmann::json::parse(read_text(directory_.path("out.json")));
  EXPECT_EQ(fit["runs"][0]["channels"][0]["missing"], 2);
  EXPECT_EQ(fit["runs"][0]["channels"][0]["samples"], 2498);
}

TEST_F(BadInput, ARunThatDoesNotBelongToTheRig) {
  expect_refused_decay(replaced(decay(), "gauge [N]", "strain [N]"), {"decay.csv:7: ", "gauge", "rig.toml"});
  expect_refused_decay(replaced(decay(), "gauge [N]", "gauge [N.m]"), {"decay.csv:7: ", "gauge", "N.m", "rig.toml"});
  const std::string modes = directory_.file("modes.toml", "unrig_rig = 1\n[[modal]]\nmass = \"1 kg\"\nfrequency = \"3 Hz\"\ndamping_ratio = 0.01\ngauge_gain = \"1 N/m\"\n");
  refused({"fit", "--rig", modes, step_}, {"step.csv:7: ", "step", "modes.toml"});
  refused({"correct", "--rig", modes, "--fit", fit_, step_}, {"fit.json", "modal[1].mass", "modes.toml"});
  refused({"correct", "--rig", rig_, "--fit", fit_, decay_}, {"decay.csv", "speed 0"});
  refused({"correct", "--rig", rig_, "--fit", fit_, step_}, {"fit.json", "normal.stiffness_scale"});
  refused({"apparent-mass", "--rig", rig_, "--dry", dry_, "--wet", step_}, {"step.csv"});
  refused({"apparent-mass", "--rig", rig_, "--dry", decay_, "--wet", dry_}, {"density"});
}

TEST_F(BadInput, FilesThatWereExchanged) {
  refused({"fit", "--rig", step_, rig_}, {"step.csv:1: this is a run file (a recording); wanted a rig file", "Have two files been exchanged on the command line?"});
  refused({"fit", "--rig", rig_, decay_, rig_}, {"rig.toml:1: this is a rig file; wanted a run file"});
  refused({"simulate", "--rig", rig_, "--run", fit_}, {"fit.json:1: this is a result of unrig (JSON); wanted a run file"});
  refused({"fit", "--rig", "/dev/zero", decay_}, {"/dev/zero", "no end of it"});
}

TEST_F(BadInput, AColumnThatWasMeantIsNamed) {
  expect_refused_step(replaced(step(), "alpha [deg]", "Alpha [deg]"), {"step.csv", "there is a column \"Alpha\""});
  expect_refused_step(replaced(step(), "alpha [deg]", "angle [deg]"), {"there is a column \"angle\""});
  expect_refused_decay(replaced(decay(), "gauge [N]", "gage [N]"), {"decay.csv:7: ", "there is a column \"gage\""});
}

/// After ten seconds: "a transform needs finite samples".
TEST_F(BadInput, ADeadEncoderIsNamed) {
  std::vector<std::string> lines = lines_of(step());
  for (std::size_t k = 7; k < lines.size(); ++k) lines[k] = without_cell(lines[k], 1, "2.07");
  step_ = directory_.file("step.csv", joined(lines));
  for (const std::vector<std::string>& arguments : {std::vector<std::string>{"fit", "--rig", rig_, decay_, step_}, {"correct", "--rig", rig_, "--fit", fit_, step_}, {"diagnose", "--rig", rig_, decay_, step_}})
    refused(arguments, {"step.csv:7: the column \"alpha\" never changes, it is 2.07 deg throughout", "dead encoder"});
}

/// Each of these ended in an error that nobody foresaw.
TEST_F(BadInput, NumbersThatNothingCanHaveAreRefused) {
  const auto all = [&](int cell, double factor) {
    std::vector<std::string> lines = lines_of(step());
    for (std::size_t k = 7; k < lines.size(); ++k) {
      std::vector<std::string> cells;
      for (std::size_t at = 0; at <= lines[k].size();) {
        const std::size_t end = std::min(lines[k].find(',', at), lines[k].size());
        cells.push_back(lines[k].substr(at, end - at));
        at = end + 1;
      }
      char number[40];
      std::snprintf(number, sizeof number, "%.17g", std::stod(cells.at(static_cast<std::size_t>(cell))) * factor);
      lines[k] = without_cell(lines[k], cell, number);
    }
    return joined(lines);
  };
  expect_refused_step(all(2, 1e307), {"step.csv:", "the column \"gauge\""});
  expect_refused_step(all(2, 1e-300), {"step.csv:7: the column \"gauge\" varies by "});
  expect_refused_step(all(0, 1e307), {"step.csv:9: the time is 2e+304 s"});
  expect_refused_step(replaced(step(), "0.6096 m/s", "1e300 m/s"), {"step.csv:6: speed is 1e+300 m/s", "speed of light"});
  expect_refused_decay(replaced(decay(), "998.2 kg/m^3", "1e30 kg/m^3"), {"decay.csv:5: density is 1e+30 kg/m^3", "osmium"});
}

/// Of the rig file there was one of 240 letters at every step of the way.
TEST_F(BadInput, AWarningIsSaidOnceAndShort) {
  const Finished finished = run_unrig(directory_, {"fit", "--rig", rig_, decay_, "-o", directory_.path("out.json")});
  EXPECT_EQ(finished.status, 0) << finished.err;
  const std::vector<std::string> lines = lines_of(finished.err);
  ASSERT_EQ(lines.size(), 1u) << finished.err;
  EXPECT_THAT(lines[0], HasSubstr("normal.flexibility"));
  EXPECT_LE(lines[0].size() - rig_.size(), 150u);
}

TEST_F(BadInput, AFlexibilityThatIsNotPositiveDefinite) {
  expect_refused_rig(replaced(rig(), "46791", "-46791"), {"rig.toml:18: ", "normal.flexibility", "element 17"});
  expect_refused_rig(replaced(rig(), "28839, 46791", "28839, 4679"), {"rig.toml:18: ", "normal.flexibility", "not positive definite"});
}

TEST_F(BadInput, MismatchedLengths) {
  const std::size_t at = rig().find("mass.values = [");
  const std::size_t comma = rig().find(',', at);
  expect_refused_rig(rig().substr(0, at + 15) + rig().substr(comma + 1), {"rig.toml:", "normal.mass", "16", "17"});
  expect_refused_rig(replaced(rig(), "elements = [15, 16, 17]", "elements = [15, 16, 18]"), {"rig.toml:", "submerged.elements", "18"});
}

TEST_F(BadInput, AFitThatIsNone) {
  refused({"correct", "--rig", rig_, "--fit", rig_, step_}, {"rig.toml", "JSON"});
  refused({"correct", "--rig", rig_, "--fit", directory_.file("other.json", R"({"unrig": "apparent-mass"})"), step_}, {"other.json", "unrig"});
  refused({"simulate", "--rig", rig_, "--run", step_, "--fit", directory_.file("bad.json", R"({"unrig": "fit", "parameters": [{"name": 3}]})")}, {"bad.json"});
}

TEST_F(BadInput, AnOutputThatCannotBeWritten) {
  const Finished finished = run_unrig(directory_, {"simulate", "--rig", rig_, "--run", step_, "-o", directory_.path("absent/out.csv")});
  EXPECT_EQ(finished.status, 2);
  EXPECT_THAT(finished.err, HasSubstr("absent/out.csv: the file cannot be written"));
  EXPECT_FALSE(std::filesystem::exists(directory_.path("absent")));
  EXPECT_THAT(finished.out, IsEmpty());
}

}  // namespace
}  // namespace unrig
