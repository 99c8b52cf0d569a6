// What the commands say about the files they are called with, before they read or compute anything.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "core/files/text_file.h"
#include "tests/commands/run_unrig.h"
#include "tests/support/sample_data.h"

namespace unrig {
namespace {

using test::Finished;
using test::null_campaign;
using test::run_unrig;
using test::TemporaryDirectory;
using ::testing::HasSubstr;

/// Copies of the sample campaign's files, which a command that does not see what it is asked may spoil.
class GivenFiles : public ::testing::Test {
 protected:
  std::string copy(const std::string& name) const { return directory_.file(name, read_text(null_campaign(name))); }

  /// Refuses with this message, and `kept` is what it was.
  void refused(const std::vector<std::string>& arguments, const std::string& kept, const std::vector<std::string>& parts) const {
    const std::string before = read_text(kept);
    const Finished finished = run_unrig(directory_, arguments);
    EXPECT_EQ(finished.status, 2) << finished.err;
    for (const std::string& part : parts) EXPECT_THAT(finished.err, HasSubstr(part));
    EXPECT_TRUE(read_text(kept) == before) << kept;
  }

  TemporaryDirectory directory_;
  const std::string rig_ = copy("rig.toml"), step_ = copy("step_a.csv"), dry_ = copy("dry_pluck.csv"), wet_ = copy("wet_pluck.csv");
  const std::string fit_ = directory_.file("fit.json", R"({"unrig": "fit", "parameters": []})");
};

TEST_F(GivenFiles, AnOutputDoesNotOverwriteAnInput) {
  const std::string out = directory_.path("out"), message = ": -o would overwrite the input";
  refused({"simulate", "--rig", rig_, "--run", step_, "-o", step_}, step_, {step_ + message + "; wanted ", "Choose another name for -o."});
  refused({"simulate", "--rig", rig_, "--run", step_, "-o", rig_}, rig_, {rig_ + message});
  refused({"fit", "--rig", rig_, dry_, wet_, "-o", wet_}, wet_, {wet_ + message});
  refused({"apparent-mass", "--rig", rig_, "--dry", dry_, "--wet", wet_, "-o", dry_}, dry_, {dry_ + message});
  refused({"diagnose", "--rig", rig_, wet_, "--heldout", step_, "-o", step_}, step_, {step_ + message});
  refused({"diagnose", "--rig", rig_, wet_, "-o", out, "--fit", wet_}, wet_, {wet_ + ": --fit would overwrite the input"});
  refused({"trial", "--rig", rig_, "--trials", "1", "-o", rig_}, rig_, {rig_ + message});
  refused({"correct", "--rig", rig_, "--fit", fit_, step_, "-o", fit_}, fit_, {fit_ + message});
  refused({"correct", "--rig", rig_, "--fit", fit_, step_, "-o", out, "--indicial", step_}, step_, {step_ + ": --indicial would overwrite the input"});
  refused({"report", fit_, "-o", fit_}, fit_, {fit_ + message});
}

TEST_F(GivenFiles, AnImportDoesNotOverwriteWhatItReads) {
  const std::string recording = directory_.file("recording.csv", "F\n1\n2\n3\n"), map = directory_.file("map.toml", "unrig_import = 1\n");
  for (const std::string& input : {recording, map}) refused({"import", recording, "--map", map, "-o", input}, input, {input + ": -o would overwrite the input"});
  EXPECT_EQ(run_unrig(directory_, {"import", recording, "--list", "-o", recording}).status, 0) << "nothing is written";
}

TEST_F(GivenFiles, NeitherThroughALinkNorAlongAnotherPath) {
  const std::string link = directory_.path("link.csv"), detour = directory_.path("./step_a.csv");
  std::filesystem::create_symlink(step_, link);
  refused({"simulate", "--rig", rig_, "--run", step_, "-o", link}, step_, {link + ": -o would overwrite the input " + step_ + ";"});
  refused({"simulate", "--rig", rig_, "--run", step_, "-o", detour}, step_, {detour + ": -o would overwrite the input " + step_ + ";"});
}

TEST_F(GivenFiles, TwoOutputsAreTwoFiles) {
  const std::string out = directory_.path("same"), detour = directory_.path("./same");
  for (const std::string& other : {out, detour}) {
    refused({"correct", "--rig", rig_, "--fit", fit_, step_, "-o", out, "--indicial", other}, step_, {out + ": -o would overwrite what --indicial writes", "wanted a file for each of them"});
    refused({"diagnose", "--rig", rig_, wet_, "-o", out, "--fit", other}, wet_, {out + ": -o would overwrite what --fit writes"});
    EXPECT_FALSE(std::filesystem::exists(out));
  }
}

TEST_F(GivenFiles, AnOutputWithoutAFolderIsRefusedBeforeAnythingIsComputed) {
  const std::string nowhere = directory_.path("absent/out"), out = directory_.path("out");
  const std::vector<std::string> parts{nowhere + ": the file cannot be written: No such file or directory; wanted ", "The folder " + directory_.path("absent/") + " is not there; make it first."};
  // Neither the rig nor the recording is one: they are not even read.
  const std::string rig = directory_.file("none.toml", "none"), run = directory_.file("none.csv", "none");
  refused({"simulate", "--rig", rig, "--run", run, "-o", nowhere}, run, parts);
  refused({"fit", "--rig", rig, run, "-o", nowhere}, run, parts);
  refused({"apparent-mass", "--rig", rig, "--dry", run, "--wet", run, "-o", nowhere}, run, parts);
  refused({"trial", "--rig", rig, "-o", nowhere}, rig, parts);
  refused({"report", run, "-o", nowhere}, run, parts);
  for (const auto& [first, second] : {std::pair{out, nowhere}, {nowhere, out}}) {
    refused({"diagnose", "--rig", rig, run, "-o", first, "--fit", second}, run, parts);
    refused({"correct", "--rig", rig, "--fit", fit_, run, "-o", first, "--indicial", second}, run, parts);
  }
  refused({"fit", "--rig", rig, run, "-o", rig + "/fit.json"}, rig, {"Not a directory"});
  EXPECT_FALSE(std::filesystem::exists(out));
}

TEST_F(GivenFiles, ADashIsNoOutput) {
  const std::string out = directory_.path("out");
  const std::vector<std::string> parts{": \"-\" names no file; wanted a file: standard output takes the summary", "/dev/stdout"};
  refused({"simulate", "--rig", rig_, "--run", step_, "-o", "-"}, step_, parts);
  refused({"report", fit_, "-o", "-"}, fit_, parts);
  refused({"correct", "--rig", rig_, "--fit", fit_, step_, "-o", out, "--indicial", "-"}, fit_, {"--indicial: \"-\" names no file"});
  EXPECT_FALSE(std::filesystem::exists("-"));
}

TEST_F(GivenFiles, ARecordingCountsOnce) {
  const std::string out = directory_.path("out"), link = directory_.path("link.csv"), detour = directory_.path("./wet_pluck.csv");
  std::filesystem::create_symlink(wet_, link);
  for (const std::string command : {"fit", "diagnose"}) {
    refused({command, "--rig", rig_, wet_, dry_, wet_, "-o", out}, wet_, {wet_ + ": the recording is given twice; wanted each once: one recording counts once. Leave one of them out."});
    for (const std::string& other : {link, detour}) refused({command, "--rig", rig_, wet_, dry_, other, "-o", out}, wet_, {other + ": the recording is given twice, also as " + wet_});
  }
  refused({"diagnose", "--rig", rig_, wet_, "--heldout", step_, "--heldout", step_, "-o", out}, step_, {step_ + ": the recording is given twice"});
}

TEST_F(GivenFiles, ARunThatIsFittedIsNotHeldOut) {
  const std::string link = directory_.path("link.csv");
  std::filesystem::create_symlink(wet_, link);
  for (const std::string& heldout : {wet_, link})
    refused({"diagnose", "--rig", rig_, dry_, wet_, "--heldout", heldout, "-o", directory_.path("out")}, wet_,
            {heldout + ": --heldout is among the runs too; wanted another: a run that was fitted cannot test the prediction. Leave it out of the runs, or leave --heldout away"});
}

TEST_F(GivenFiles, WhatAnEarlierCallWroteIsOverwritten) {
  const std::string out = directory_.file("out.csv", "what an earlier call found");
  EXPECT_EQ(run_unrig(directory_, {"simulate", "--rig", rig_, "--run", step_, "-o", out}).status, 0);
  EXPECT_THAT(read_text(out), HasSubstr("unrig_run = 1"));
}

TEST_F(GivenFiles, WhatIsNoFileIsNeverTheSame) {
  EXPECT_EQ(run_unrig(directory_, {"simulate", "--rig", rig_, "--run", step_, "-o", "/dev/null"}).status, 0);
  refused({"correct", "--rig", rig_, "--fit", fit_, step_, "-o", "/dev/null", "--indicial", "/dev/null"}, fit_, {"fit.json", "normal.stiffness_scale"});
}

}  // namespace
}  // namespace unrig
