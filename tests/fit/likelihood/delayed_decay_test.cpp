// A pluck that is released as its record begins, read by a channel that is late: readings shifted sample by sample, nothing of the filters that stand for a delay is in them.

#include <gtest/gtest.h>

#include <algorithm>

#include "core/model/simulate.h"
#include "tests/fit/run_cases.h"

namespace unrig {
namespace {

using namespace run_cases;

constexpr Index finer = 4, late = 13;  // fine samples

/// The channel shows for `shift` fine samples what was before the release.
unrig::Run late_pluck(const AeroelasticModel& model, Index shift) {
  SimulateProblem problem{model, model.start_values(), empty_run(RunKind::pluck, 0, dt / finer), {}, 30.0, {}, {}};
  constexpr Index coarse = 1000;
  add_channel(problem.run, "note", VectorXd::Zero(finer * coarse));
  const VectorXd fine = simulate(problem).run.channel("gauge").value;
  unrig::Run run = empty_run(RunKind::pluck, 0, dt);
  const VectorXd noise = white_noise(coarse, 0.03, 9);
  add_channel(run, "gauge", VectorXd::NullaryExpr(coarse, [&](Index k) { return fine[std::max<Index>(0, finer * k - shift)] + noise[k]; }));
  return run;
}

double left_of(const AeroelasticModel& model, const VectorXd& theta, const unrig::Run& run) {
  const RunResidual residual(model, run, {});
  return residual.solve(theta).chi2 * std::pow(residual.sigma(0) / 0.03, 2) / static_cast<double>(residual.degrees_of_freedom());
}

TEST(DelayedDecay, ShowsWhatWasBeforeTheRecord) {
  const auto bare = beam_model();
  const AeroelasticModel delayed = bare->with_effects({"channel-delay"});
  VectorXd theta = delayed.start_values();
  double& time = theta[delayed.index("channel-delay.time")];
  time = static_cast<double>(late) * dt / finer;
  const unrig::Run run = late_pluck(*bare, late);
  constexpr double scatter = 0.25;  // five standard deviations of chi-square over a thousand samples
  EXPECT_NEAR(left_of(*bare, bare->start_values(), late_pluck(*bare, 0)), 1, scatter) << "a decay from the first sample on";
  EXPECT_GT(left_of(*bare, bare->start_values(), run), 3) << "a decay is not what it shows";
  EXPECT_NEAR(left_of(delayed, theta, run), 1, scatter);
}

}  // namespace
}  // namespace unrig
