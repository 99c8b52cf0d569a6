// The motion that a measured angle says, against the motion that the campaigns' generator gave the shaft (truth_*.csv).
#include "fit/likelihood/shaft_motion.h"

#include <gtest/gtest.h>

#include <numbers>

#include "core/model/simulate.h"
#include "fit/fit.h"
#include "tests/support/csv_column.h"
#include "tests/support/sample_data.h"

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

Run recording(const std::string& name) { return read_run(test::null_campaign(name + ".csv")); }

double rms(const VectorXd& x) { return std::sqrt(x.squaredNorm() / static_cast<double>(x.size())); }

TEST(ShaftMotion, IsNearerToTheTruthThanItsReadings) {
  const Rig rig = read_rig(test::null_campaign("rig.toml"));
  for (const std::string name : {"step_a", "step_b", "step_c", "heldout"}) {
    constexpr double degree = std::numbers::pi / 180;
    const VectorXd truth = test::column_of(test::null_campaign("truth_" + name + ".csv"), "alpha") * degree, measured = recording(name).channel("alpha").value;
    const std::optional<ShaftMotion> motion = shaft_motion(rig, recording(name));
    ASSERT_TRUE(motion) << name;
    std::vector<Index> sound;  // the angle has electrical spikes
    for (Index k = 0; k < truth.size(); ++k)
      if (std::abs(measured[k] - truth[k]) < 5 * motion->noise) sound.push_back(k);
    EXPECT_NEAR(motion->noise, rms((measured - truth)(sound)), 0.05 * motion->noise) << name << ": 3000 samples tell it to 1.3 %, differences of them to 2 %";
    // A rest is known to its mean; the knots, each of a few readings, are less than a tenth of the record.
    EXPECT_LT(rms(motion->angle - truth), 0.3 * motion->noise) << name;
    // What matters: second differences, which are load. Of readings they scatter by sqrt(6) of the noise; here only where the shaft moves, in less than a tenth of the record, and
    // there the prior leaves a part of it.
    const auto bend = [](const VectorXd& x) -> VectorXd { return x.tail(x.size() - 2) - 2 * x.segment(1, x.size() - 2) + x.head(x.size() - 2); };
    EXPECT_LT(rms(bend(motion->angle) - bend(truth)), 0.05 * std::sqrt(6) * motion->noise) << name;
  }
}

/// What the gauge adds to this in a fit, which sees the shaft's acceleration in it, is left out on purpose: a prediction may not look at what it predicts.
TEST(ShaftMotion, DoesNotLookAtTheGauge) {
  const Rig rig = read_rig(test::null_campaign("rig.toml"));
  unrig::Run run = recording("step_b"), without = run;
  std::erase_if(without.channels, [](const Channel& c) { return c.name == "gauge"; });
  const VectorXd angle = shaft_motion(rig, run)->angle, alone = shaft_motion(rig, without)->angle;
  EXPECT_LT((angle - alone).cwiseAbs().maxCoeff(), 1e-3 * shaft_motion(rig, run)->noise);
}

TEST(ShaftMotion, OfAnAngleThatIsExactOrHasNoRestIsNotAsked) {
  const Rig rig = read_rig(test::null_campaign("rig.toml"));
  unrig::Run planned = recording("step_b");
  for (Channel& channel : planned.channels)
    if (channel.name == "alpha")
      for (Index k = 0; k < channel.value.size(); ++k) channel.value[k] = 0.05 + 0.02 * std::clamp((static_cast<double>(k) - 500) / 20, 0.0, 1.0);
  EXPECT_FALSE(shaft_motion(rig, planned)) << "at rest it does not scatter";
  unrig::Run restless = recording("step_b");
  for (Channel& channel : restless.channels)
    if (channel.name == "alpha")
      for (Index k = 0; k < channel.value.size(); ++k) channel.value[k] += 0.05 * std::sin(2 * std::numbers::pi * static_cast<double>(k) / 300);
  EXPECT_FALSE(shaft_motion(rig, restless)) << "knots on every sample would follow the noise, fewer not the motion";
  EXPECT_FALSE(shaft_motion(rig, recording("wet_pluck"))) << "no shaft";
}

/// `heldout` took no part in the fit, and no reading of its gauge is looked at.
TEST(ShaftMotion, PredictsARecordingToItsNoise) {
  FitProblem problem;
  problem.rig = read_rig(test::null_campaign("rig.toml"));
  for (const char* name : {"dry_pluck", "wet_pluck", "step_a", "step_b"}) problem.runs.push_back(recording(name));
  const FitResult fitted = fit(problem);
  const AeroelasticModel model = model_of(problem.rig, problem.runs, problem.circulation, {});
  VectorXd theta = model.start_values();
  for (const FittedParameter& p : fitted.parameters)
    if (p.name != "steady_normal_force") theta[model.index(p.name)] = p.value;
  unrig::Run run = recording("heldout");
  const VectorXd measured = run.channel("gauge").value;
  for (Channel& channel : run.channels)
    if (channel.name == "alpha") channel.value = shaft_motion(problem.rig, run)->angle;
  VectorXd off = measured - simulate({model, theta, run, PitchBetweenSamples::spline, {}, {}}).run.channel("gauge").value;
  off.array() -= off.mean();  // the steady load was not in the fit
  constexpr double noise = 0.0272;  // KEY.json; beside it what the angle leaves open of a motion of 40 ms, half of the noise and more in step_b, which is twice as fast
  EXPECT_LT(rms(off), 1.3 * noise) << "as recorded: 35 times the noise";
}

}  // namespace
}  // namespace unrig
