// The binary on free decays that begin with the hold before their release.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <random>
#include <sstream>
#include <string>

#include <fmt/format.h>
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
using ::testing::ContainsRegex;
using ::testing::HasSubstr;
using ::testing::Not;

constexpr int held = 300;
constexpr double step = 0.002, level = 31.55, noise = 0.03;  // s, N: those of the sample's decays

/// The sample's decay behind a hold: it was released at its first sample.
std::string with_hold(const std::string& text) {
  std::mt19937_64 random(11);
  std::normal_distribution<double> normal(0, noise);
  const std::size_t rows = text.find('\n', text.find("time [s]")) + 1;
  std::string out = text.substr(0, rows);
  for (int k = 0; k < held; ++k) out += fmt::format("{:.3f},{:.4f},{:.5f}\n", step * k, 0.3 * normal(random), level + normal(random));
  std::istringstream lines(text.substr(rows));
  for (std::string line; std::getline(lines, line);) out += fmt::format("{:.3f}{}\n", std::stod(line) + step * held, line.substr(line.find(',')));
  return out;
}

class HeldPluck : public ::testing::Test {
 protected:
  test::TemporaryDirectory directory;
  const std::string rig = null_campaign("rig.toml"), dry = null_campaign("dry_pluck.csv"), wet = null_campaign("wet_pluck.csv");
  const std::string held_dry = directory.file("dry_pluck.csv", with_hold(read_text(dry))), held_wet = directory.file("wet_pluck.csv", with_hold(read_text(wet)));
  const std::string out = directory.path("out.json");

  json result() const { return json::parse(read_text(out)); }
};

TEST_F(HeldPluck, IsFittedAsTheDecayAlone) {
  const Finished plain = run_unrig(directory, {"fit", "--rig", rig, dry, wet, "-o", out});
  ASSERT_EQ(plain.status, 0) << plain.err;
  const json alone = result();
  EXPECT_THAT(plain.out, Not(HasSubstr("released at")));
  EXPECT_FALSE(alone["runs"][0].contains("release"));
  const Finished finished = run_unrig(directory, {"fit", "--rig", rig, held_dry, held_wet, "-o", out});
  ASSERT_EQ(finished.status, 0) << finished.err;
  EXPECT_EQ(finished.err, plain.err) << "it is no fault";
  EXPECT_THAT(finished.out, ContainsRegex("dry_pluck.csv: [0-9]+ samples, reduced chi-square [0-9.]+, released at 0.[56][0-9]* s, 30[0-9] samples of hold before left out"));
  const json with = result();
  for (const json& run : with["runs"]) {
    EXPECT_NEAR(run["release"].get<double>(), step * held, 3 * step) << run["file"];
    EXPECT_GE(run["held"].get<int>(), held) << run["file"];
    EXPECT_LT(run["held"].get<int>(), held + 10) << run["file"];
  }
  ASSERT_EQ(with["parameters"].size(), alone["parameters"].size());
  for (std::size_t i = 0; i < with["parameters"].size(); ++i) {
    const json &p = with["parameters"][i], &q = alone["parameters"][i];
    if (!p["identified"] || !q["identified"]) continue;
    EXPECT_NEAR(p["value"].get<double>(), q["value"].get<double>(), q["std_error"].get<double>()) << p["name"];
  }
}

TEST_F(HeldPluck, IsTold) {
  const Finished check = run_unrig(directory, {"check", "--rig", rig, held_dry, held_wet, "-o", out});
  EXPECT_EQ(check.status, 0) << check.err;
  EXPECT_THAT(check.err, Not(HasSubstr("check:")));
  EXPECT_THAT(check.out, ContainsRegex("released at 0.[56][0-9]* s, 30[0-9] samples of hold before left out"));
  EXPECT_NEAR(result()["runs"][0]["release"]["value"].get<double>(), step * held, 3 * step);
  const Finished mass = run_unrig(directory, {"apparent-mass", "--rig", rig, "--dry", held_dry, "--wet", held_wet, "-o", out});
  EXPECT_EQ(mass.status, 0) << mass.err;
  EXPECT_THAT(mass.out, ContainsRegex("Vibrations in dry_pluck.csv.*released at 0.[56]"));
  EXPECT_NEAR(result()["wet"]["release"].get<double>(), step * held, 3 * step);
}

}  // namespace
}  // namespace unrig
