// Results say what made them: program, command, rig and recordings; and whoever reads them compares.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "core/files/csv_table.h"
#include "core/rig/fingerprint.h"
#include "core/files/text_file.h"
#include "tests/commands/run_unrig.h"
#include "tests/support/replaced.h"
#include "tests/support/sample_data.h"

namespace unrig {
namespace {

using nlohmann::json;
using test::Finished;
using test::TemporaryDirectory;
using test::null_campaign;
using test::replaced;
using test::run_unrig;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

/// The name of the last column: what made the table.
std::string made_by(const std::string& file) { return read_csv(read_text(file), 1, file).columns.back().name; }

class ProvenanceOf : public ::testing::Test {
 protected:
  void SetUp() override {
    const Finished finished = run_unrig(directory_, {"fit", "--rig", rig_, wet_, step_, "-o", fit_});
    ASSERT_EQ(finished.status, 0) << finished.err;
  }
  Finished correct(const std::string& rig, const std::string& fit, const std::string& out = "corrected.csv", const std::string& indicial = "indicial.csv", const std::string& run = null_campaign("step_a.csv")) const {
    return run_unrig(directory_, {"correct", "--rig", rig, "--fit", fit, run, "-o", directory_.path(out), "--indicial", directory_.path(indicial)});
  }

  TemporaryDirectory directory_;
  const std::string rig_ = null_campaign("rig.toml"), wet_ = null_campaign("wet_pluck.csv"), step_ = null_campaign("step_a.csv"), fit_ = directory_.path("fit.json");
};

TEST_F(ProvenanceOf, EveryResultNamesProgramCommandRigAndRuns) {
  const std::string rig = fingerprint(read_rig(rig_)), step = fingerprint(read_run(step_));
  const json fit = json::parse(read_text(fit_));
  EXPECT_THAT(fit["program"].get<std::string>(), ::testing::MatchesRegex("unrig [0-9.]+"));
  EXPECT_EQ(fit["command"], "unrig fit --rig " + rig_ + " " + wet_ + " " + step_);
  EXPECT_EQ(fit["rig_fingerprint"], rig);
  EXPECT_EQ(fit["runs"][1]["fingerprint"], step);

  ASSERT_EQ(correct(rig_, fit_).status, 0);
  const std::string table = made_by(directory_.path("corrected.csv"));
  EXPECT_THAT(table, AllOf(HasSubstr("made by: unrig "), HasSubstr("; rig=" + rig + ";"), HasSubstr("; run=" + step + ";"), HasSubstr("; fit="), HasSubstr("; command=unrig correct --rig " + rig_ + " --fit " + fit_ + " " + step_)));
  EXPECT_EQ(made_by(directory_.path("indicial.csv")), table) << "they belong together";
  EXPECT_THAT(read_text(directory_.path("corrected.csv")), Not(HasSubstr("#"))) << "what readers that skip comments would cut off";

  const std::string simulated = directory_.path("simulated.csv"), apparent = directory_.path("apparent.json");
  ASSERT_EQ(run_unrig(directory_, {"simulate", "--rig", rig_, "--fit", fit_, "--run", step_, "-o", simulated}).status, 0);
  EXPECT_THAT(read_text(simulated), AllOf(HasSubstr("# # made by: unrig "), HasSubstr("; rig=" + rig + "; run=" + step + ";"), HasSubstr("; command=unrig simulate --rig ")));
  ASSERT_EQ(run_unrig(directory_, {"apparent-mass", "--rig", rig_, "--dry", null_campaign("dry_pluck.csv"), "--wet", wet_, "--no-joint-fit", "-o", apparent}).status, 0);
  const json mass = json::parse(read_text(apparent));
  EXPECT_EQ(mass["rig_fingerprint"], rig);
  EXPECT_EQ(mass["wet"]["fingerprint"], fingerprint(read_run(wet_)));
  EXPECT_THAT(mass["command"].get<std::string>(), HasSubstr("unrig apparent-mass --rig "));
}

TEST_F(ProvenanceOf, TheSameInputsGiveTheSameBytes) {
  const std::string again = directory_.path("elsewhere.json");
  ASSERT_EQ(run_unrig(directory_, {"fit", "--threads", "1", "--rig", rig_, wet_, step_, "--output", again}).status, 0);
  EXPECT_EQ(read_text(again), read_text(fit_));
  ASSERT_EQ(correct(rig_, fit_, "a.csv", "b.csv").status, 0);
  ASSERT_EQ(correct(rig_, fit_, "c.csv", "d.csv").status, 0);
  EXPECT_EQ(read_text(directory_.path("a.csv")), read_text(directory_.path("c.csv")));
  EXPECT_EQ(read_text(directory_.path("b.csv")), read_text(directory_.path("d.csv")));
}

TEST_F(ProvenanceOf, AFitOfAnotherRigIsNotUsed) {
  const std::string rig = read_text(rig_);
  // `correct` ended with 0 on each of these.
  const std::size_t at = rig.find("chord = \"") + 9;
  const std::string wider = directory_.file("wider.toml", rig.substr(0, at) + "1" + rig.substr(at));
  const Finished finished = correct(wider, fit_);
  EXPECT_EQ(finished.status, 2);
  EXPECT_THAT(finished.err, AllOf(HasSubstr(wider), HasSubstr("[section]"), HasSubstr(fit_), HasSubstr("Fit this rig")));
  EXPECT_FALSE(std::filesystem::exists(directory_.path("corrected.csv")));
  const Finished simulated = run_unrig(directory_, {"simulate", "--rig", wider, "--fit", fit_, "--run", step_, "-o", directory_.path("simulated.csv")});
  EXPECT_EQ(simulated.status, 0) << "what would be is a fair question; " << simulated.err;
  EXPECT_THAT(simulated.err, AllOf(HasSubstr(wider), HasSubstr("[section]"), HasSubstr(fit_)));

  // The recordings may have come through different amplifiers.
  const std::string amplifier = directory_.file("amplifier.toml", replaced(rig, "[gauge]", "[gauge]\nlowpass = { order = 1, cutoff = \"200 Hz\" }"));
  const Finished amplified = correct(amplifier, fit_);
  EXPECT_NE(amplified.status, 2) << amplified.err;
  EXPECT_THAT(amplified.err, HasSubstr("warning: " + amplifier + ": other numbers in [gauge] than the rig " + rig_ + " that " + fit_ + " was fitted to"));
  EXPECT_THAT(read_text(directory_.path("corrected.csv")), HasSubstr("other numbers in (gauge)")) << "in the table too";

  // Other words and units are the same rig.
  const std::string renamed = directory_.file("renamed.toml", "# a remark\n" + rig);
  const Finished same = correct(renamed, fit_);
  EXPECT_EQ(same.status, 0) << same.err;
  EXPECT_THAT(same.err, Not(HasSubstr("fitted to")));
}

TEST_F(ProvenanceOf, AReportSaysThatTheRigIsAnother) {
  const std::string text = read_text(rig_), output = directory_.path("report.html"), rig = directory_.file("rig.toml", text), fit = directory_.path("own.json");
  ASSERT_EQ(run_unrig(directory_, {"fit", "--rig", rig, wet_, step_, "-o", fit}).status, 0);
  const Finished right = run_unrig(directory_, {"report", fit, "-o", output});
  EXPECT_EQ(right.status, 0);
  EXPECT_THAT(right.err, IsEmpty());
  EXPECT_THAT(read_text(output), HasSubstr("Made by unrig "));

  const std::size_t at = text.find("chord = \"") + 9;
  directory_.file("rig.toml", text.substr(0, at) + "1" + text.substr(at));
  const Finished changed = run_unrig(directory_, {"report", fit, "-o", output});
  EXPECT_EQ(changed.status, 0) << changed.err;
  EXPECT_THAT(changed.err, HasSubstr("other numbers in [section]"));
  EXPECT_THAT(read_text(output), AllOf(HasSubstr("other numbers in [section]"), HasSubstr("gauge: residual")));

  directory_.file("rig.toml", replaced(text, "calibration_element = ", "calibration_element = 15 # "));
  const Finished other = run_unrig(directory_, {"report", fit, "-o", output});
  EXPECT_EQ(other.status, 0) << other.err;
  EXPECT_THAT(other.err, AllOf(HasSubstr("its structure"), HasSubstr("its plots are left out")));
  EXPECT_THAT(read_text(output), Not(HasSubstr("gauge: residual")));
}

TEST_F(ProvenanceOf, AFitOfAnEarlierVersionStillWorks) {
  json fit = json::parse(read_text(fit_));
  for (const char* key : {"rig_fingerprint", "program", "command"}) fit.erase(key);
  const std::string earlier = directory_.file("earlier.json", fit.dump());
  const Finished finished = correct(rig_, earlier);
  EXPECT_EQ(finished.status, 0) << finished.err;
  EXPECT_THAT(finished.err, HasSubstr("does not say what the rig was"));
}

TEST_F(ProvenanceOf, ACopyUnderAnotherNameIsTheSameRecording) {
  // Another name, another title, a column that nothing reads: still the same readings.
  std::string text = replaced(read_text(wet_), "# name = \"", "# name = \"copy of ");
  std::string copied;
  bool header = true;
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t end = text.find('\n', at);
    const std::string line = text.substr(at, end - at);
    copied += line.starts_with("#") ? line : line + (header ? ",temperature [K]" : ",291");
    if (!line.starts_with("#")) header = false;
    copied += "\n";
    at = end + 1;
  }
  const std::string copy = directory_.file("copy.csv", copied), out = directory_.path("out.json");
  for (const std::vector<std::string>& command : std::vector<std::vector<std::string>>{{"fit", "--rig", rig_, wet_, step_, copy, "-o", out}, {"diagnose", "--rig", rig_, wet_, step_, copy, "-o", out}}) {
    const Finished finished = run_unrig(directory_, command);
    EXPECT_EQ(finished.status, 2) << command.front();
    EXPECT_THAT(finished.err, HasSubstr(copy + ": it holds the same readings as " + wet_));
  }
  const Finished heldout = run_unrig(directory_, {"diagnose", "--rig", rig_, wet_, step_, "--heldout", copy, "-o", out});
  EXPECT_EQ(heldout.status, 2);
  EXPECT_THAT(heldout.err, HasSubstr(copy + ": --heldout holds the same readings as the run " + wet_));
  EXPECT_FALSE(std::filesystem::exists(out));
}

TEST_F(ProvenanceOf, APairThatWasPartedIsRefused) {
  const auto path = [&](const char* name) { return directory_.path(name); };
  ASSERT_EQ(correct(rig_, fit_, "old.csv", "old_indicial.csv").status, 0);
  const std::string other_fit = path("other.json");
  ASSERT_EQ(run_unrig(directory_, {"fit", "--rig", rig_, null_campaign("dry_pluck.csv"), wet_, step_, "-o", other_fit}).status, 0);
  ASSERT_EQ(correct(rig_, other_fit, "new.csv", "new_indicial.csv").status, 0);
  const std::string output = path("report.html");
  const Finished parted = run_unrig(directory_, {"report", path("new.csv"), path("old_indicial.csv"), "-o", output});
  EXPECT_EQ(parted.status, 2);
  EXPECT_THAT(parted.err, AllOf(HasSubstr(path("new.csv")), HasSubstr(path("old_indicial.csv")), HasSubstr("another call of `unrig correct`")));
  EXPECT_FALSE(std::filesystem::exists(output));
  const Finished both = run_unrig(directory_, {"report", path("new.csv"), path("old_indicial.csv"), path("old.csv"), path("new_indicial.csv"), "-o", output});
  EXPECT_EQ(both.status, 0) << "two pairs beside each other: " << both.err;
}

/// The second output cannot be written: the first is not there either.
TEST_F(ProvenanceOf, APairAppearsTogetherOrNotAtAll) {
  const Finished full = run_unrig(directory_, {"correct", "--rig", rig_, "--fit", fit_, step_, "-o", "/dev/full", "--indicial", directory_.path("indicial.csv")});
  EXPECT_EQ(full.status, 2);
  EXPECT_FALSE(std::filesystem::exists(directory_.path("indicial.csv"))) << "it was written before the other had failed";
}

}  // namespace
}  // namespace unrig
