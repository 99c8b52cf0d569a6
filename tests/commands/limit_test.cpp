// `diagnose --limit` and `--work`: a search that is ended says so, and tells what it has; where counted work ended it, the same however many threads there are.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

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
using test::TemporaryDirectory;
using ::testing::HasSubstr;
using ::testing::Not;

Finished diagnose(const TemporaryDirectory& directory, const std::string& campaign, const std::vector<std::string>& options) {
  const auto file = [&](const std::string& name) { return test::source_path("sample_data/campaigns/" + campaign + "/" + name); };
  std::vector<std::string> words{"diagnose", "--rig", file("rig.toml"), file("dry_pluck.csv"), file("wet_pluck.csv"), file("step_a.csv"), file("step_b.csv"), file("step_c.csv"), "-o", directory.path("diagnosis.json")};
  words.insert(words.end(), options.begin(), options.end());
  return test::run_unrig(directory, words);
}

TEST(Limit, EndsTheSearchAndSaysSo) {
  const TemporaryDirectory directory;
  const Finished stopped = diagnose(directory, "friction", {"--limit", "0.001"});
  EXPECT_EQ(stopped.status, 1) << stopped.err;  // something is missing, and nothing was found
  EXPECT_THAT(stopped.out, HasSubstr("[[Stopped]]"));
  const json result = json::parse(read_text(directory.path("diagnosis.json")));
  EXPECT_EQ(result["stopped"], true);
  EXPECT_EQ(result["unexplained"], true);
  EXPECT_TRUE(result["missing"].empty());
  EXPECT_FALSE(result["fit"]["parameters"].empty());  // the fit with nothing missing is described all the same
}

TEST(Limit, ThatIsNotReachedChangesNothing) {
  const TemporaryDirectory directory;
  const Finished whole = diagnose(directory, "null", {"--limit", "1000", "--work", "inf"});
  EXPECT_EQ(whole.status, 0) << whole.err;
  EXPECT_THAT(whole.out, Not(HasSubstr("[[Stopped]]")));
  EXPECT_FALSE(json::parse(read_text(directory.path("diagnosis.json"))).contains("stopped"));
}

TEST(Limit, IsAboveZero) {
  const TemporaryDirectory directory;
  for (const std::string option : {"--limit", "--work"})
    for (const std::string limit : {"-1", "0", "soon", "nan"}) {
      const Finished refused = diagnose(directory, "null", {option, limit});
      EXPECT_EQ(refused.status, 2) << limit;
      EXPECT_THAT(refused.err, HasSubstr(option + ": " + limit + ", where a number above zero is wanted, or inf for any"));
    }
}

TEST(Work, EndsTheSearchAtTheSameStepHoweverManyThreadsThereAre) {
  const TemporaryDirectory directory;
  const std::string path = directory.path("diagnosis.json");
  std::string first;
  for (const std::string threads : {"1", "3"}) {
    const Finished finished = diagnose(directory, "wave", {"--work", "6", "--limit", "inf", "--threads", threads});
    const json result = json::parse(read_text(path));
    EXPECT_EQ(result["stopped"], true) << finished.err;
    EXPECT_GT(result["work"], 6);
    EXPECT_GT(result["ranking"].size(), 1u) << "what was tried by then is told";
    if (first.empty()) first = read_text(path);
    else EXPECT_EQ(first, read_text(path));
  }
}

}  // namespace
}  // namespace unrig
