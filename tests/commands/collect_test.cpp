#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "tests/commands/run_unrig.h"
#include "tests/support/sample_data.h"

// Studies cut into shards: `unrig trial --shard`, `--cases` and `unrig collect`.

namespace unrig {
namespace {

using nlohmann::json;
using test::run_unrig;
using testing::HasSubstr;

class Collect : public testing::Test {
 protected:
  /// Six campaigns of one pluck, half of them with hum.
  std::vector<std::string> trial(const std::string& output, const std::vector<std::string>& more = {}) const {
    std::vector<std::string> words{"trial", "--rig", test::null_campaign("rig.toml"), test::null_campaign("dry_pluck.csv"), "--effects", "mains-hum", "--trials", "6", "-o", path(output)};
    words.insert(words.end(), more.begin(), more.end());
    return words;
  }
  std::string path(const std::string& name) const { return directory_.path(name); }
  std::string text(const std::string& name) const { return test::whole_file(path(name)); }
  void done(const std::vector<std::string>& words) const {
    const test::Finished finished = run_unrig(directory_, words);
    ASSERT_EQ(finished.status, 0) << finished.err;
  }
  void refused(const std::vector<std::string>& words, const std::string& why) const {
    const test::Finished finished = run_unrig(directory_, words);
    EXPECT_EQ(finished.status, 2);
    EXPECT_THAT(finished.err, HasSubstr(why));
  }

  test::TemporaryDirectory directory_;
};

TEST_F(Collect, GivesTheSameBytesForAnyNumberOfShardsInAnyOrder) {
  done(trial("one.json", {"--shard", "1/1"}));
  done({"collect", path("one.json"), "-o", path("all_of_one.json")});
  for (const char* i : {"1", "2", "3", "4"}) done(trial(std::string("part") + i + ".json", {"--shard", std::string(i) + "/4"}));
  done({"collect", path("part3.json"), path("part1.json"), path("part4.json"), path("part2.json"), "-o", path("all.json")});
  EXPECT_EQ(text("all.json"), text("all_of_one.json"));
  const json all = json::parse(text("all.json"));
  ASSERT_EQ(all.at("trials").size(), 6u);
  EXPECT_EQ(all.at("nulls"), 3);
  for (const json& one : all.at("trials")) EXPECT_FALSE(one.contains("seconds"));
  EXPECT_FALSE(all.contains("shard"));
}

TEST_F(Collect, RefusesWhatDoesNotBelongTogether) {
  done(trial("part1.json", {"--shard", "1/2"}));
  refused({"collect", path("part1.json"), "-o", path("all.json")}, "3 of 6 trials are in none of the files, the first is number 1");
  EXPECT_FALSE(std::filesystem::exists(path("all.json")));
  done(trial("other.json", {"--shard", "2/2", "--seed", "2"}));
  refused({"collect", path("part1.json"), path("other.json"), "-o", path("all.json")}, "another study");
  std::ofstream(path("fit.json")) << R"({"unrig": "fit"})";
  refused({"collect", path("fit.json"), "-o", path("all.json")}, "no result of a trial");
  json changed = json::parse(text("part1.json"));
  changed["trials"][0]["unexplained"] = true;
  std::ofstream(path("part1_again.json")) << changed;
  refused({"collect", path("part1.json"), path("part1_again.json"), "-o", path("all.json")}, "another outcome of trial 0");
}

TEST_F(Collect, ASecondCallComputesOnlyWhatIsMissing) {
  done(trial("first.json", {"--cases", path("cases")}));
  std::vector<std::filesystem::path> cases;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(path("cases")))
    if (entry.is_regular_file()) cases.push_back(entry.path());
  ASSERT_EQ(cases.size(), 6u);
  std::filesystem::remove(cases[0]);
  std::ofstream(cases[1]) << "{\"trial\": ";                                        // cut off
  std::string kept = test::whole_file(cases[2].string());
  kept.replace(kept.find("\"size\":"), 7, "\"size\":7");                             // a mark that only a found case has
  std::ofstream(cases[2]) << kept;
  const auto marked = json::parse(kept).at("trial").get<std::size_t>();
  done(trial("second.json", {"--cases", path("cases")}));
  const json first = json::parse(text("first.json")), second = json::parse(text("second.json"));
  for (std::size_t i = 0; i < 6; ++i) {
    if (i == marked) EXPECT_NE(first["trials"][i]["size"], second["trials"][i]["size"]);
    else EXPECT_EQ(first["trials"][i]["size"], second["trials"][i]["size"]);
  }
  done(trial("other.json", {"--cases", path("cases"), "--seed", "2"}));
  EXPECT_NE(json::parse(text("other.json"))["trials"][marked]["size"], second["trials"][marked]["size"]) << "another study has cases of its own";
}

TEST_F(Collect, TakesItsShardFromASlurmArrayOrOpenMpi) {
  const auto shard_in = [&](const std::vector<std::pair<std::string, std::string>>& environment) {
    for (const auto& [name, value] : environment) setenv(name.c_str(), value.c_str(), 1);
    const test::Finished finished = run_unrig(directory_, trial("part.json"));
    for (const auto& [name, value] : environment) unsetenv(name.c_str());
    return finished.status == 0 ? json::parse(text("part.json")).value("shard", "all") : finished.err;
  };
  EXPECT_EQ(shard_in({{"SLURM_ARRAY_TASK_ID", "12"}, {"SLURM_ARRAY_TASK_MIN", "10"}, {"SLURM_ARRAY_TASK_COUNT", "6"}}), "3/6");
  EXPECT_EQ(shard_in({{"OMPI_COMM_WORLD_RANK", "0"}, {"OMPI_COMM_WORLD_SIZE", "6"}}), "1/6");
  EXPECT_THAT(shard_in({{"SLURM_ARRAY_TASK_ID", "9"}, {"SLURM_ARRAY_TASK_MIN", "1"}, {"SLURM_ARRAY_TASK_COUNT", "6"}}), HasSubstr("wanted an array without gaps"));
  refused(trial("part.json", {"--shard", "7/6"}), "wanted i/n");
  refused(trial("part.json", {"--shard", "one"}), "wanted i/n");
}

}  // namespace
}  // namespace unrig
