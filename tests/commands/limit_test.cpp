// `diagnose --limit`: a search that is ended says so, and tells what it has.

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

Finished diagnose(const TemporaryDirectory& directory, const std::string& campaign, const std::string& limit) {
  const auto file = [&](const std::string& name) { return test::source_path("sample_data/campaigns/" + campaign + "/" + name); };
  return test::run_unrig(directory, {"diagnose", "--limit", limit, "--rig", file("rig.toml"), file("dry_pluck.csv"), file("wet_pluck.csv"), file("step_a.csv"), file("step_b.csv"), file("step_c.csv"), "-o",
                                     directory.path("diagnosis.json")});
}

TEST(Limit, EndsTheSearchAndSaysSo) {
  const TemporaryDirectory directory;
  const Finished stopped = diagnose(directory, "friction", "0.001");
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
  const Finished whole = diagnose(directory, "null", "1000");
  EXPECT_EQ(whole.status, 0) << whole.err;
  EXPECT_THAT(whole.out, Not(HasSubstr("[[Stopped]]")));
  EXPECT_FALSE(json::parse(read_text(directory.path("diagnosis.json"))).contains("stopped"));
}

TEST(Limit, IsATime) {
  const TemporaryDirectory directory;
  for (const std::string limit : {"-1", "0", "soon"}) EXPECT_EQ(diagnose(directory, "null", limit).status, 2) << limit;
}

}  // namespace
}  // namespace unrig
