#include "fit/search/find_motion.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "fit/fit.h"
#include "fit/search/own_parameters.h"
#include "tests/support/sample_data.h"
#include "tests/support/shared_data.h"

namespace unrig {
namespace {

/// A step beside dry friction that the decays of its campaign have told, what all runs share held.
JointProblem step_beside_friction() {
  const auto path = [](const char* file) { return test::shared_path(std::string("campaigns/concealed/c08/") + file); };
  FitProblem decays;
  decays.rig = read_rig(path("rig.toml"));
  for (const char* file : {"dry_pluck.csv", "wet_pluck.csv"}) decays.runs.push_back(read_run(path(file)));
  decays.effects = {"coulomb-friction"};
  const FitResult known = fit(decays);

  static const std::vector<unrig::Run> step{read_run(path("step_a.csv"))};  // the residual looks at it
  static const AeroelasticModel model = model_of(decays.rig, step, decays.circulation, decays.effects);
  std::vector<RunResidual> one;
  one.emplace_back(model, step.front(), motion_windows(step.front()));
  JointProblem joint(model, std::move(one));
  for (Unknown& u : joint.unknowns())
    for (const FittedParameter& p : known.parameters)
      if (u.run < 0 && p.name == joint.parameter(u).name) u.value = p.value, u.held = true;
  return joint;
}

constexpr double by_chance = 0.1;  // five standard deviations of chi-square over 5700 samples

TEST(FindMotion, AStepBesideDryFrictionIsFollowedToItsNoise) {
  UNRIG_NEEDS_SHARED("campaigns/concealed/c08/rig.toml");
  JointProblem joint = step_beside_friction();
  const auto freedom = static_cast<double>(joint.runs().front().degrees_of_freedom());
  JointProblem without = joint;
  without.solve({});
  EXPECT_GT(without.chi2(), 2 * freedom) << "a search that lets in all of the gauge at once ends in a least chi-square of other jerks";
  fit_own_parameters(joint);
  EXPECT_LT(joint.chi2(), (1 + by_chance) * freedom);
}

/// A fit without the law may have taken the slope to its limit.
TEST(FindMotion, ASlopeThatWentAstrayIsFoundAgain) {
  UNRIG_NEEDS_SHARED("campaigns/concealed/c08/rig.toml");
  JointProblem joint = step_beside_friction();
  for (Unknown& u : joint.unknowns())
    if (joint.parameter(u).name == "normal_force_slope") u.value = joint.parameter(u).lower;
  joint.runs().front().solve(joint.theta(0));
  const auto freedom = static_cast<double>(joint.runs().front().degrees_of_freedom());
  JointProblem explained = joint;
  fit_own_parameters(explained, std::numeric_limits<double>::infinity());
  EXPECT_EQ(explained.theta(0), joint.theta(0)) << "it is not left with so much";
  fit_own_parameters(joint, 10);
  EXPECT_LT(joint.chi2(), (1 + by_chance) * freedom);
}

/// As a law may in a run that was not fitted: there is no trajectory to be found, and that is no fault.
TEST(FindMotion, LeavesARunAsItIsFromWhichTheModelRunsAway) {
  const Rig rig = read_rig(test::null_campaign("rig.toml"));
  const AeroelasticModel model = AeroelasticModel(rig, make_basis(rig, Eigen::Index{2}, Eigen::Index{1}), wagner(Wagner::jones)).with_effects({"cubic-stiffness"});
  Eigen::VectorXd theta = model.start_values();
  theta[model.index("cubic-stiffness.coefficient")] = std::nan("");
  const unrig::Run step = read_run(test::null_campaign("step_a.csv"));
  RunResidual run(model, step, motion_windows(step));
  ASSERT_TRUE(std::isinf(run.solve(theta).chi2));
  EXPECT_TRUE(find_motion(run, theta));
  EXPECT_TRUE(std::isinf(run.solve(theta).chi2));
  EXPECT_EQ(run.tempered(), 1);
}

TEST(FindMotion, OfALinearModelThereIsNothingToFind) {
  UNRIG_NEEDS_SHARED("campaigns/concealed/c08/rig.toml");
  const Rig rig = read_rig(test::shared_path("campaigns/concealed/c08/rig.toml"));
  const std::vector<unrig::Run> step{read_run(test::shared_path("campaigns/concealed/c08/step_b.csv"))};
  const AeroelasticModel model = model_of(rig, step, Wagner::within_1e4, {});
  RunResidual run(model, step.front(), motion_windows(step.front()));
  EXPECT_FALSE(find_motion(run, model.start_values()));
}

}  // namespace
}  // namespace unrig
