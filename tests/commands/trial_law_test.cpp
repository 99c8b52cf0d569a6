#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <vector>

#include "tests/commands/run_unrig.h"
#include "tests/support/sample_data.h"

// `unrig trial --law`.

namespace unrig {
namespace {

using nlohmann::json;
using test::run_unrig;
using testing::HasSubstr;

/// Half a second of a pluck, so that a diagnosis takes little.
std::string short_pluck(const test::TemporaryDirectory& directory) {
  std::istringstream whole(test::whole_file(test::null_campaign("dry_pluck.csv")));
  std::string text, line;
  for (int k = 0; k < 257 && std::getline(whole, line); ++k) text += line + "\n";
  return directory.file("pluck.csv", text);
}

TEST(TrialLaw, GivesTheSameBytesFromShards) {
  const test::TemporaryDirectory directory;
  const std::string pluck = short_pluck(directory);
  const auto done = [&](const std::string& output, const std::string& shard) {
    const test::Finished finished = run_unrig(directory, {"trial", "--rig", test::null_campaign("rig.toml"), pluck, "--law", "--ideal", "--trials", "2", "--seed", "3", "--noise", "0.1 N", "--shard", shard, "-o", directory.path(output)});
    ASSERT_EQ(finished.status, 0) << finished.err;
    EXPECT_THAT(finished.out, HasSubstr("[[Laws]]"));
  };
  done("one.json", "1/1");
  done("part1.json", "1/2");
  done("part2.json", "2/2");
  for (const std::vector<std::string>& parts : {std::vector<std::string>{"one.json"}, {"part2.json", "part1.json"}}) {
    std::vector<std::string> words{"collect"};
    for (const std::string& part : parts) words.push_back(directory.path(part));
    words.insert(words.end(), {"-o", directory.path("all_of_" + parts.front())});
    ASSERT_EQ(run_unrig(directory, words).status, 0);
  }
  EXPECT_EQ(test::whole_file(directory.path("all_of_one.json")), test::whole_file(directory.path("all_of_part2.json")));
  const json all = json::parse(test::whole_file(directory.path("all_of_one.json")));
  EXPECT_EQ(all.at("laws").at("campaigns"), 2);
  for (std::size_t i = 0; i < 2; ++i) {
    const json& one = all.at("trials")[i];
    ASSERT_FALSE(one.contains("failure")) << one;
    EXPECT_EQ(one.at("hidden")[0], all.at("hidden_in_turn")[i]);
    EXPECT_EQ(one.at("law").at("hidden").at("effect"), one.at("hidden")[0]);
    EXPECT_EQ(one.at("law").at("noise"), 0.1);
    EXPECT_TRUE(one.at("law").at("heldout_over_exact").is_number()) << "a pluck was held out";
    EXPECT_LT(one.at("law").at("exact_reduced_chi2"), 1.2) << "white noise, exact files: the exact model leaves nothing";
  }
}

TEST(TrialLaw, IsNotForEffectsThatAreNamedNorForPairsOrNulls) {
  const test::TemporaryDirectory directory;
  for (const std::vector<std::string>& more : {std::vector<std::string>{"--effects", "tank-wave"}, {"--pairs"}, {"--nulls"}}) {
    std::vector<std::string> words{"trial", "--rig", test::null_campaign("rig.toml"), "--law", "-o", directory.path("out.json")};
    words.insert(words.end(), more.begin(), more.end());
    const test::Finished finished = run_unrig(directory, words);
    EXPECT_EQ(finished.status, 2);
    EXPECT_THAT(finished.err, HasSubstr("excludes"));
  }
}

}  // namespace
}  // namespace unrig
