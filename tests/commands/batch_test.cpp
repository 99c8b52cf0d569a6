#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include "tests/commands/batch_campaigns.h"
#include "tests/commands/run_unrig.h"
#include "tests/support/sample_data.h"

// Many campaigns in one call: `unrig batch`, its shards, and `unrig collect`.

namespace unrig {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using test::run_unrig;
using testing::HasSubstr;
using testing::Not;

/// Cells of a table with quotes around those that need them.
std::vector<std::vector<std::string>> cells_of(const std::string& text) {
  std::vector<std::vector<std::string>> rows(1, {""});
  bool quoted = false;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    if (quoted && c == '"' && i + 1 < text.size() && text[i + 1] == '"') rows.back().back() += text[++i];
    else if (c == '"') quoted = !quoted;
    else if (!quoted && c == ',') rows.back().emplace_back();
    else if (!quoted && c == '\n') rows.push_back({""});
    else rows.back().back() += c;
  }
  rows.pop_back();
  return rows;
}

/// A table by run and heading.
class Table {
 public:
  explicit Table(const std::string& text) : cells_(cells_of(text)) {
    for (const auto& row : cells_) EXPECT_EQ(row.size(), cells_.front().size());
  }
  std::size_t rows() const { return cells_.size() - 1; }
  bool has(const std::string& heading) const { return column(heading) < cells_.front().size(); }
  std::string at(const std::string& run, const std::string& heading) const {
    for (std::size_t r = 1; r < cells_.size(); ++r)
      if (cells_[r][1] == run) return column(heading) < cells_[r].size() ? cells_[r][column(heading)] : "no column " + heading;
    return "no run " + run;
  }

 private:
  std::size_t column(const std::string& heading) const { return static_cast<std::size_t>(std::find(cells_.front().begin(), cells_.front().end(), heading) - cells_.front().begin()); }
  std::vector<std::vector<std::string>> cells_;
};

class BatchCommand : public testing::Test {
 protected:
  std::string path(const std::string& name) const { return directory_.path(name); }
  std::string text(const std::string& name) const { return test::whole_file(path(name)); }
  void write(const std::string& name, const std::string& content) const { std::ofstream(path(name)) << content; }
  test::Finished batch(const std::string& output, const std::vector<std::string>& more = {}) const {
    std::vector<std::string> words{"batch", path("campaigns.toml"), "-o", path(output)};
    words.insert(words.end(), more.begin(), more.end());
    return run_unrig(directory_, words);
  }
  void done(const std::string& output, const std::vector<std::string>& more = {}) const {
    const test::Finished finished = batch(output, more);
    ASSERT_EQ(finished.status, 0) << finished.err;
  }
  void collect(const std::vector<std::string>& parts, const std::string& output) const {
    std::vector<std::string> words{"collect"};
    for (const std::string& part : parts) words.push_back(path(part));
    words.insert(words.end(), {"-o", path(output)});
    const test::Finished finished = run_unrig(directory_, words);
    ASSERT_EQ(finished.status, 0) << finished.err;
  }
  /// What the folder of cases holds, with the time of each file's last change.
  std::map<std::string, fs::file_time_type> kept(const std::string& folder = "campaigns.cases") const {
    std::map<std::string, fs::file_time_type> files;
    for (const auto& entry : fs::directory_iterator(path(folder))) files[entry.path().filename().string()] = entry.last_write_time();
    return files;
  }
  void refused(const std::string& campaigns, const std::string& where, const std::string& why) const {
    write("campaigns.toml", campaigns);
    const test::Finished finished = batch("table.csv");
    EXPECT_EQ(finished.status, 2);
    EXPECT_THAT(finished.err, HasSubstr("campaigns.toml:" + where + ": "));
    EXPECT_THAT(finished.err, HasSubstr(why));
    EXPECT_FALSE(fs::exists(path("table.csv")));
  }

  test::TemporaryDirectory directory_;
};

TEST_F(BatchCommand, HasTheNumbersOfTheSingleCommandsInTheRowOfEachRun) {
  fs::create_directory_symlink(test::source_path("sample_data/campaigns/null"), path("null"));
  write("campaigns.toml", R"(unrig_batch = 1
[[campaign]]
name = "null"
rig = "null/rig.toml"
runs = ["null/*_pluck.csv", "null/step_[ab].csv"]
heldout = ["null/heldout.csv"]
further = ["null/step_c.csv"]
commands = ["apparent-mass", "correct", "check", "diagnose"]
)");
  done("table.csv", {"--report", path("table.html")});
  const Table table(text("table.csv"));
  ASSERT_EQ(table.rows(), 6u);
  for (const char* run : {"null/dry_pluck.csv", "null/wet_pluck.csv", "null/step_a.csv", "null/step_b.csv", "null/heldout.csv", "null/step_c.csv"}) {
    EXPECT_EQ(table.at(run, "status"), "done") << run;
    EXPECT_EQ(table.at(run, "campaign"), "null");
  }
  EXPECT_EQ(table.at("null/step_c.csv", "part"), "further");
  EXPECT_EQ(table.at("null/wet_pluck.csv", "density [kg/m^3]"), "998.2");
  EXPECT_EQ(table.at("null/wet_pluck.csv", "correct"), "") << "a free decay has no load to correct";
  EXPECT_EQ(table.at("null/step_a.csv", "diagnose.missing"), "");
  EXPECT_EQ(table.at("null/step_a.csv", "diagnose.unexplained"), "false");
  EXPECT_EQ(table.at("null/step_c.csv", "fit.rms_residual [N]"), "") << "it had no part in the fit";

  const auto run = [&](const std::vector<std::string>& words) {
    const test::Finished finished = run_unrig(directory_, words);
    ASSERT_EQ(finished.status, 0) << finished.err;
  };
  const std::string rig = path("null/rig.toml");
  run({"fit", "--rig", rig, path("null/dry_pluck.csv"), path("null/wet_pluck.csv"), path("null/step_a.csv"), path("null/step_b.csv"), "-o", path("fit.json")});
  run({"correct", "--rig", rig, "--fit", path("fit.json"), path("null/step_c.csv"), "-o", path("corrected.csv")});
  run({"apparent-mass", "--rig", rig, "--dry", path("null/dry_pluck.csv"), "--wet", path("null/wet_pluck.csv"), "-o", path("apparent.json")});
  const json fit = json::parse(text("fit.json")), apparent = json::parse(text("apparent.json"));
  for (const json& parameter : fit.at("parameters")) {
    const std::string name = parameter.at("name"), unit = parameter.at("unit"), heading = "fit." + name + (unit == "1" ? "" : " [" + unit + "]");
    const std::string row = parameter.contains("run") ? fs::path(parameter.at("run").get<std::string>()).lexically_relative(path("")).string() : "null/heldout.csv";
    EXPECT_EQ(std::stod(table.at(row, heading)), parameter.at("value").get<double>()) << name;
  }
  EXPECT_EQ(std::stod(table.at("null/step_b.csv", "fit.rms_residual [N]")), fit.at("runs").at(3).at("rms_residual").get<double>());
  EXPECT_EQ(std::stod(table.at("null/step_b.csv", "apparent-mass.mass [kg/m]")), apparent.at("apparent_mass").at("value").get<double>());
  const std::vector<std::vector<std::string>> corrected = cells_of(text("corrected.csv"));
  ASSERT_EQ(corrected.front()[5], "circulatory [N]");
  EXPECT_EQ(std::stod(table.at("null/step_c.csv", "correct.circulatory_end [N]")), std::stod(corrected.back()[5]));
  EXPECT_EQ(std::stod(table.at("null/step_c.csv", "correct.circulatory_before [N]")), std::stod(corrected[1][5]));
  const std::string page = text("table.html");
  EXPECT_THAT(page, HasSubstr("null/step_c.csv"));
  EXPECT_THAT(page, HasSubstr("6 done"));
}

TEST_F(BatchCommand, AFailureIsARowWithItsMessage) {
  test::write_decays(path(""), 3);
  write("c0001/decay.csv", "# unrig_run = 1\n# kind = \"pluck\"\n# density = \"1.2 kg/m^3\"\n# speed = \"0 m/s\"\n# name = \"<script>alert(1)</script>\"\ntime [s],gauge [N]\n0,1\n0.1,x,\"\n");
  fs::remove(path("c0002/decay.csv"));
  write("c0002/<b>&.csv", "no run");
  done("table.csv", {"--report", path("table.html")});
  const Table table(text("table.csv"));
  ASSERT_EQ(table.rows(), 3u);
  EXPECT_EQ(table.at("c0000/decay.csv", "status"), "done");
  EXPECT_EQ(table.at("c0001/decay.csv", "status"), "unusable");
  EXPECT_THAT(table.at("c0001/decay.csv", "message"), HasSubstr("c0001/decay.csv:8: "));
  EXPECT_EQ(table.at("c0002/<b>&.csv", "fit"), "unusable");
  EXPECT_THAT(text("table.html"), HasSubstr("c0002/\\u003cb>&.csv"));
  EXPECT_THAT(text("table.html"), Not(HasSubstr("<b>&.csv"))) << "what comes from files is text in the page";
  // Nothing done at all.
  fs::remove_all(path("c0000"));
  const test::Finished finished = batch("other.csv");
  EXPECT_EQ(finished.status, 1);
  EXPECT_EQ(Table(text("other.csv")).rows(), 2u);
}

TEST_F(BatchCommand, AnAbsentFileIsARowToo) {
  test::write_decays(path(""), 1);
  write("campaigns.toml", "unrig_batch = 1\ncommands = [\"fit\"]\n[[campaign]]\nname = \"a\"\nrig = \"rig.toml\"\nruns = [\"c0000/decay.csv\"]\n[[campaign]]\nname = \"b\"\nrig = \"rig.toml\"\nruns = [\"absent.csv\"]\n");
  done("table.csv");
  const Table table(text("table.csv"));
  EXPECT_EQ(table.at("c0000/decay.csv", "status"), "done");
  EXPECT_THAT(table.at("absent.csv", "message"), HasSubstr("fit: absent.csv: the file cannot be read"));
}

TEST_F(BatchCommand, ShardsGiveTheSameBytes) {
  test::write_decays(path(""), 7);
  done("table.csv");
  done("all.json");
  for (const int shards : {1, 2, 3, 9}) {  // two of the nine are empty
    std::vector<std::string> parts;
    for (int i = shards; i >= 1; --i) {
      parts.push_back(fmt::format("part_{}_{}.json", shards, i));
      const test::Finished finished = batch(parts.back(), {"--shard", fmt::format("{}/{}", i, shards), "--cases", path(fmt::format("cases{}", shards))});
      ASSERT_EQ(finished.status, 0) << finished.err;
    }
    collect(parts, "collected.csv");
    EXPECT_EQ(text("collected.csv"), text("table.csv")) << shards;
    collect(parts, "collected.json");
    EXPECT_EQ(text("collected.json"), text("all.json")) << shards;
  }
  EXPECT_THAT(text("table.csv"), Not(HasSubstr(path("")))) << "nothing of where it was made";
  test::Finished finished = batch("part.csv", {"--shard", "1/2"});
  EXPECT_EQ(finished.status, 2);
  EXPECT_THAT(finished.err, HasSubstr("wanted -o FILE.json"));
  finished = run_unrig(directory_, {"collect", path("part_3_1.json"), path("part_3_3.json"), "-o", path("x.csv")});
  EXPECT_EQ(finished.status, 2);
  EXPECT_THAT(finished.err, HasSubstr("cases are in none of the files"));
}

TEST_F(BatchCommand, ALongCampaignIsCutToo) {
  fs::create_directory_symlink(test::source_path("sample_data/campaigns/null"), path("null"));
  for (int i = 0; i < 20; ++i) fs::copy_file(test::null_campaign("step_c.csv"), path(fmt::format("further_{:02}.csv", i)));
  write("campaigns.toml", "unrig_batch = 1\n[[campaign]]\nname = \"null\"\nrig = \"null/rig.toml\"\nruns = [\"null/dry_pluck.csv\", \"null/step_a.csv\"]\nfurther = [\"further_*.csv\"]\ncommands = [\"correct\"]\n");
  done("table.csv");
  done("all.json");
  const json whole = json::parse(text("all.json"));
  done("part1.json", {"--shard", "1/2"});
  done("part2.json", {"--shard", "2/2"});
  EXPECT_EQ(json::parse(text("part1.json")).at("cases").size(), 17u) << "the fit and sixteen corrections";
  EXPECT_EQ(json::parse(text("part2.json")).at("cases").size(), whole.at("cases").size() - 17);
  collect({"part2.json", "part1.json"}, "collected.csv");
  EXPECT_EQ(text("collected.csv"), text("table.csv"));
  // Twenty copies of one recording: corrected once, beside step_a; each correction is a load and a response beside its case.
  EXPECT_EQ(kept().size(), 2u + 2 * 3u);
}

TEST_F(BatchCommand, ASecondCallComputesOnlyWhatIsMissing) {
  test::write_decays(path(""), 3);
  done("table.csv");
  const auto first = kept();
  ASSERT_EQ(first.size(), 3u * 4) << "check and fit, each a case and a result";
  const std::string table = text("table.csv");
  done("again.csv");
  EXPECT_EQ(text("again.csv"), table);
  EXPECT_EQ(kept(), first);
  // A file that is called otherwise is the same recording.
  fs::rename(path("c0000/decay.csv"), path("c0000/renamed.csv"));
  done("renamed.csv");
  EXPECT_EQ(kept(), first);
  std::string expected = table;
  for (std::size_t at = 0; (at = expected.find("c0000/decay.csv", at)) != std::string::npos;) expected.replace(at, 15, "c0000/renamed.csv");
  EXPECT_EQ(text("renamed.csv"), expected);
  // What a cut file would have been is computed again.
  std::string cut;
  for (const auto& [name, time] : first)
    if (cut.empty() && name.size() == std::string("0123456789abcdef.json").size()) cut = name;
  const std::string content = text("campaigns.cases/" + cut);
  std::ofstream(path("campaigns.cases/" + cut)) << content.substr(0, content.size() / 2);
  done("mended.csv");
  EXPECT_EQ(text("mended.csv"), text("renamed.csv"));
  EXPECT_EQ(text("campaigns.cases/" + cut).size(), content.size());
  const auto mended = kept();
  // Another content is another case; the others stay.
  test::write_decay(path("c0001/decay.csv"), 77);
  done("changed.csv");
  const auto now = kept();
  EXPECT_EQ(now.size(), mended.size() + 4);
  for (const auto& [name, time] : mended) EXPECT_EQ(now.at(name), time);
  EXPECT_NE(text("changed.csv"), text("renamed.csv"));
}

/// Starts `unrig ARGUMENTS` and kills it after `milliseconds`; whether it was still at work then.
bool killed_after(int milliseconds, std::vector<std::string> words) {
  words.insert(words.begin(), test::unrig_binary());
  std::vector<char*> argv;
  for (std::string& word : words) argv.push_back(word.data());
  argv.push_back(nullptr);
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  for (const int stream : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) posix_spawn_file_actions_addopen(&actions, stream, "/dev/null", O_RDWR, 0);
  pid_t process = 0;
  const bool started = posix_spawn(&process, argv.front(), &actions, nullptr, argv.data(), environ) == 0;
  posix_spawn_file_actions_destroy(&actions);
  if (!started) return false;
  std::this_thread::sleep_for(std::chrono::milliseconds(milliseconds));
  ::kill(process, SIGKILL);
  int status = 0;
  ::waitpid(process, &status, 0);
  return WIFSIGNALED(status);
}

TEST_F(BatchCommand, KillsAtRandomTimesLeaveTheSameBytes) {
  test::write_decays(path(""), 40);
  const auto begun = std::chrono::steady_clock::now();
  done("table.csv", {"--cases", path("calm")});
  const int whole = static_cast<int>(std::chrono::duration_cast<std::chrono::milliseconds>(std::chrono::steady_clock::now() - begun).count());
  std::mt19937 random(30);
  int kills = 0;
  for (int i = 0; i < 8; ++i) kills += killed_after(std::uniform_int_distribution<int>(1, std::max(2, whole / 4))(random), {"batch", path("campaigns.toml"), "-o", path("killed.csv")}) ? 1 : 0;
  EXPECT_GT(kills, 0);
  done("killed.csv");
  EXPECT_EQ(text("killed.csv"), text("table.csv"));
  std::vector<std::string> names[2];
  for (const auto& [name, time] : kept("calm")) names[0].push_back(name);
  for (const auto& [name, time] : kept()) names[1].push_back(name);
  EXPECT_EQ(names[0], names[1]) << "nothing half-written stays";
  for (const std::string& name : names[0]) {
    if (!name.ends_with(".json")) continue;
    EXPECT_EQ(text("campaigns.cases/" + name), text("calm/" + name));
  }
}

TEST_F(BatchCommand, AsManyFilesAsThereAre) {
  const char* const asked = std::getenv("UNRIG_BATCH_FILES");  // 4000 for the study in tests/studies/SHARDS.md
  const int count = asked ? std::atoi(asked) : 60;
  test::write_decays(path(""), count);
  const auto seconds = [&](const std::string& output) {
    const auto begun = std::chrono::steady_clock::now();
    done(output, {"--report", path("table.html")});
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - begun).count();
  };
  const double first = seconds("table.csv");
  const auto computed = kept();
  const double second = seconds("again.csv");
  std::printf("%d files: %.1f s, again %.1f s; table %.2f MB, page %.2f MB\n", count, first, second, static_cast<double>(fs::file_size(path("table.csv"))) / 1e6, static_cast<double>(fs::file_size(path("table.html"))) / 1e6);
  const Table table(text("table.csv"));
  ASSERT_EQ(table.rows(), static_cast<std::size_t>(count));
  EXPECT_EQ(text("again.csv"), text("table.csv"));
  EXPECT_EQ(kept(), computed) << "nothing is computed twice";
  for (int i = 0; i < count; ++i) {
    std::string run = fmt::format("c{:04}/decay.csv", i);
    ASSERT_EQ(table.at(run, "status"), "done") << run << ": " << table.at(run, "message");
  }
  const std::string page = text("table.html");
  EXPECT_THAT(page, HasSubstr(fmt::format("c{:04}/decay.csv", count - 1)));
}

TEST_F(BatchCommand, SaysWhereAFileOfCampaignsIsWrong) {
  test::write_decays(path(""), 1);
  const std::string head = "unrig_batch = 1\nrig = \"rig.toml\"\n", one = "[[campaign]]\nname = \"a\"\nruns = [\"c0000/decay.csv\"]\n";
  refused("[[campaign]]\n", "1", "no key \"unrig_batch\"");
  refused("unrig_batch = 2\n" + one, "1", "wanted 1");
  refused(head + "runs = 3\n" + one, "3", "the key \"runs\" is unknown");
  refused(head + "[[campaign]\n", "3", "wanted TOML");
  refused(head, "1", "lacks the key \"campaign\"");
  refused(head + "[[campaign]]\nname = \"a\"\n", "3", "lacks the key");
  refused(head + "[[campaign]]\nname = \"a\"\nruns = []\n", "5", "is empty");
  refused(head + "[[campaign]]\nname = \"a\"\nruns = [\"c0000/*.txt\"]\n", "5", "no file matches \"c0000/*.txt\"");
  refused(head + "[[campaign]]\nname = \"a\"\nruns = [\"c0000/decay.csv\", \"c0000/*.csv\"]\n", "5", "c0000/decay.csv twice");
  refused(head + one + "commands = [\"fit\", \"diagnos\"]\n", "6", "Did you mean diagnose?");
  refused(head + one + "effects = [\"quadratic-drg\"]\n", "6", "quadratic-drg");
  refused(head + one + "candidates = [\"tank-wave\"]\n", "6", "wanted diagnose among the commands");
  refused(head + one + one, "7", "stands already in line 4");
  refused(head + "[[campaign]]\nfolder = \"d*\"\nruns = [\"*.csv\"]\n", "4", "no folder is called d*");
  refused("unrig_batch = 1\n" + one, "2", "\"campaign[1].rig\"");
  // Nor does a table take the place of a recording.
  write("campaigns.toml", head + one);
  const std::string recording = text("c0000/decay.csv");
  EXPECT_EQ(batch("c0000/decay.csv").status, 2);
  EXPECT_EQ(text("c0000/decay.csv"), recording);
}

}  // namespace
}  // namespace unrig
