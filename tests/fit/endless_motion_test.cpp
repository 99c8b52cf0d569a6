#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <random>

#include "core/files/error.h"
#include "fit/fit.h"

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

std::string sample(const std::string& file) { return std::string(UNRIG_SOURCE_DIR) + "/sample_data/campaigns/null/" + file; }

/// A shaft that wanders at random through the whole record: a fit of it took more than minutes, and had no way to end well.
TEST(EndlessMotion, ThatTheKnotsDoNotFollowIsRefusedAtOnce) {
  for (const Index samples : {20000, 100000}) {
    unrig::Run run = read_run(sample("step_a.csv"));
    std::mt19937_64 engine(3);
    std::normal_distribution<double> normal(0, 1);
    VectorXd angle(samples), gauge(samples);
    double at = 0.05, rate = 0;
    for (Index k = 0; k < samples; ++k) {
      rate += 2e-4 * normal(engine) - 0.05 * rate;
      at += rate - 1e-3 * (at - 0.05);
      angle[k] = at + 2e-4 * normal(engine);
      gauge[k] = 10 * at + 0.03 * normal(engine);
    }
    for (Channel& channel : run.channels) channel.value = channel.name == "alpha" ? angle : gauge;
    FitProblem problem;
    problem.rig = read_rig(sample("rig.toml"));
    problem.runs = {run};
    try {
      fit(problem);
      ADD_FAILURE() << "no error";
    } catch (const InputError& error) {
      EXPECT_THAT(error.what(), ::testing::HasSubstr("without a rest")) << samples;
      EXPECT_THAT(error.what(), ::testing::HasSubstr("unrig correct"));
    }
  }
}

}  // namespace
}  // namespace unrig
