#include "core/fingerprint.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/sample_data.h"

namespace unrig {
namespace {

TEST(Fingerprint, IsThatOfTheAlgorithm) {
  // By another implementation (Python's integers, the constants of the draft), over the same bytes: four doubles, the name and its end, two doubles.
  unrig::Run run;
  run.density = 998.2;
  run.speed = 0.6;
  run.dt = 0.002;
  run.channels.push_back({"gauge", "N", "N", 1, Eigen::Vector2d(1.5, -2)});
  EXPECT_EQ(fingerprint(run), "8842b77f0bd58441");
}

TEST(Fingerprint, TellsRecordingsApartAndNotTheirFiles) {
  const unrig::Run run = read_run(test::null_campaign("step_b.csv"));
  unrig::Run renamed = run, changed = run, faster = run, gap = run, other_gap = run;
  renamed.file = "elsewhere.csv";
  EXPECT_EQ(fingerprint(renamed), fingerprint(run));
  changed.channels.back().value[1234] *= 1 + 1e-15;
  EXPECT_NE(fingerprint(changed), fingerprint(run));
  faster.speed *= 1.01;
  EXPECT_NE(fingerprint(faster), fingerprint(run));
  gap.channels.back().value[7] = std::nan("");
  other_gap.channels.back().value[7] = -std::nan("1");
  EXPECT_NE(fingerprint(gap), fingerprint(run));
  EXPECT_EQ(fingerprint(gap), fingerprint(other_gap));
}

}  // namespace
}  // namespace unrig
