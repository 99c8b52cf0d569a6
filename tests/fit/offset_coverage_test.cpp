#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "core/rig/bridge.h"
#include "core/model/simulate.h"
#include "fit/fit.h"
#include "fit/likelihood/joint_problem.h"
#include "fit/likelihood/run_residual.h"
#include "fit/uncertainty/uncertainty.h"
#include "fit/uncertainty/undetermined.h"
#include "tests/support/sample_data.h"

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

constexpr double steady_coefficient = 0.2, slope = 5.5, gauge_noise = 0.03, angle_noise = 2e-4;

/// A step of 2 deg in 25 samples, 600 samples at 250 Hz, without noise.
unrig::Run simulated_step(const AeroelasticModel& model) {
  unrig::Run plan;
  plan.file = "step.csv";
  plan.kind = RunKind::step;
  plan.density = 998.2;
  plan.speed = 0.6;
  plan.dt = 0.004;
  const VectorXd angle = VectorXd::NullaryExpr(600, [](Index k) {
    const double x = std::clamp((static_cast<double>(k) - 150) / 25, 0.0, 1.0);
    return 0.036 + 0.035 * x * x * x * (10 - 15 * x + 6 * x * x);
  });
  plan.channels.push_back({"alpha", "rad", "rad", 1, angle, 0});
  VectorXd theta = model.start_values();
  theta[model.index("normal_force_slope")] = slope;
  return simulate({model, theta, plan, PitchBetweenSamples::spline, {}, steady_coefficient}).run;
}

/// The offset of the gauge is the steady load of the fit. What the unknowns do to it is a part of its error, its own noise the other: without that, errors of a step are 0.6 to 0.7 of what they
/// should be, and the mean square below 2 to 2.8.
TEST(Offset, ErrorsCoverTheTruth) {
  const Rig rig = read_rig(test::null_campaign("rig.toml"));
  const AeroelasticModel model(rig, make_basis(rig, Index{2}, Index{1}), wagner(Wagner::within_1e4));
  const unrig::Run clean = simulated_step(model);
  const double truth = steady_coefficient * reading_of_unit_coefficient(rig, gauge_levers(rig), clean.density, clean.speed);
  double squares = 0;
  constexpr int seeds = 40;
  for (int seed = 1; seed <= seeds; ++seed) {
    std::mt19937_64 random(static_cast<unsigned>(seed));
    unrig::Run run = clean;
    for (Channel& channel : run.channels) {
      std::normal_distribution<double> noise(0, channel.name == "alpha" ? angle_noise : gauge_noise);
      for (double& value : channel.value) value += noise(random);
    }
    JointProblem joint(model, {RunResidual(model, run, motion_windows(run))});
    for (Unknown& unknown : joint.unknowns())
      if (joint.parameter(unknown).name == "normal_force_slope") unknown.value = slope;
    hold_undetermined(joint);
    joint.solve({});
    const ParameterUncertainty uncertainty = estimate_uncertainty(joint);
    const auto place = static_cast<Index>(uncertainty.free.size());
    const double offset = joint.runs().front().evaluate(joint.theta(0), Partials::none).linear[joint.runs().front().first_offset()];
    squares += std::pow(offset - truth, 2) / uncertainty.white_covariance(place, place) / seeds;
  }
  // A mean of forty squares scatters by 0.22.
  EXPECT_GT(squares, 1 - 3 * 0.22);
  EXPECT_LT(squares, 1 + 3 * 0.22);
}

}  // namespace
}  // namespace unrig
