#include "fit/search/decays_first.h"

#include <gtest/gtest.h>

#include <memory>
#include <random>
#include <stdexcept>
#include <string>
#include <vector>

#include "core/numerics/in_parallel.h"
#include "fit/search/arrival.h"
#include "fit/diagnose/diagnose.h"
#include "fit/trial/laboratory.h"
#include "fit/trial/trial_campaign.h"
#include "fit/search/effect_search.h"
#include "fit/search/noise_of_trial.h"
#include "fit/fit.h"
#include "tests/support/sample_data.h"

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

TEST(DecaysFirst, ResidualAndSlopesSideBySide) {
  const Rig rig = read_rig(test::null_campaign("rig.toml"));
  const unrig::Run run = read_run(test::null_campaign("wet_pluck.csv"));
  const AeroelasticModel model = AeroelasticModel(rig, make_basis(rig, Index{2}, Index{1}), wagner(Wagner::jones)).with_effects({"cubic-stiffness"});
  VectorXd theta = model.start_values();
  theta[model.index("cubic-stiffness.coefficient")] = 1e6;
  const RunResidual residual(model, run, {});
  VectorXd c = residual.solve(theta).linear;
  c.head(c.size() - 1) *= 0.9;  // off any least chi-square
  constexpr Index samples = 400;
  const auto chi2 = [&](const VectorXd& at, const VectorXd& linear) { return residual.side_by_side(at, linear, samples, Partials::none).chi2; };
  const RunResidual::SideBySide s = residual.side_by_side(theta, c, samples, Partials::all);
  EXPECT_NEAR(s.residual.squaredNorm(), s.chi2, 1e-9 * s.chi2);
  EXPECT_NEAR(s.chi2, chi2(theta, c), 1e-9 * s.chi2);
  const VectorXd in_theta = 2 * s.in_theta.transpose() * s.residual, in_c = 2 * s.in_c.transpose() * s.residual;
  const auto slope_of = [&](VectorXd& x, Index j, double h) {
    const double there = x[j];
    x[j] = there + h;
    const double up = chi2(theta, c);
    x[j] = there - h;
    const double down = chi2(theta, c);
    x[j] = there;
    return (up - down) / (2 * h);
  };
  for (const char* name : {"normal.stiffness_scale", "normal.damping_ratio", "apparent_mass_coefficient", "cubic-stiffness.coefficient"}) {
    const Index j = model.index(name);
    EXPECT_NEAR(slope_of(theta, j, 1e-4 * theta[j]), in_theta[j], 1e-4 * std::abs(in_theta[j])) << name;  // a ten-thousandth squared, times the curvature
  }
  const double largest = in_c.cwiseProduct(c).cwiseAbs().maxCoeff();
  for (Index j = 0; j < c.size(); ++j) {
    if (c[j] == 0) continue;
    EXPECT_NEAR(slope_of(c, j, 1e-4 * c[j]) * c[j], in_c[j] * c[j], 1e-4 * largest) << j;
  }
}

/// A simulated campaign with an effect hidden in it, and its fit without that effect.
struct Hidden {
  std::shared_ptr<const FitProblem> problem;  // the fit looks at its runs
  std::vector<double> parameters;
  Trial baseline;
};

Hidden hide(const std::string& effect, unsigned seed, unsigned trial, const Laboratory& laboratory = ideal_laboratory()) {
  std::seed_seq sequence{seed, trial};
  std::mt19937_64 random(sequence);
  const TrialCampaign campaign = draw_campaign(read_rig(test::null_campaign("rig.toml")), {effect}, draw_runs(0.03, random), laboratory, random);
  const auto problem = std::make_shared<FitProblem>();
  problem->rig = campaign.rig;
  problem->runs = campaign.runs;
  return {problem, campaign.parameters, fit_baseline(*problem)};
}

TEST(DecaysFirst, FreeplayIsFoundFromATorsionSpringThatIsFarOff) {
  // The fit without the gap takes it for a soft, strongly damped torsion spring.
  const Hidden hidden = hide("freeplay", 8, 1);
  ASSERT_GT(hidden.baseline.reduced_chi2(), 10);
  Trial trial = prepare(*hidden.problem, hidden.baseline, {"freeplay"});
  ASSERT_TRUE(has_decays(trial.arrival.joint));
  const DecaysLeft left = fit_decays(trial.arrival.joint, "freeplay");
  EXPECT_LT(left.chi2 - 1, (1 - enough_to_name) * (left_of_decays(hidden.baseline) - 1)) << "the share that an effect may leave and be named";
  ASSERT_EQ(unknowns_of(trial.arrival.joint, "freeplay").size(), 1u);
  EXPECT_NEAR(unknowns_of(trial.arrival.joint, "freeplay").front()->value / hidden.parameters.front(), 1, 0.04) << "0.007 here; of 19 drawn like this one the largest is 0.038, since searches end in least chi-squares beside the deepest";
}

TEST(DecaysFirst, ASmallGapIsFollowedToTheNoise) {
  const Hidden hidden = hide("freeplay", 702, 20);  // half a gap of 0.0026 degrees, ten times the noise at most
  ASSERT_GT(hidden.baseline.reduced_chi2(), 2);
  Trial trial = prepare(*hidden.problem, hidden.baseline, {"freeplay"});
  const DecaysLeft left = fit_decays(trial.arrival.joint, "freeplay");
  EXPECT_TRUE(left.exactly);
  EXPECT_LT(left.chi2, 1.15) << "what counts as explained";
  EXPECT_NEAR(unknowns_of(trial.arrival.joint, "freeplay").front()->value / hidden.parameters.front(), 1, 0.02) << "0.011 measured; its whole trace is ten times the noise at most";
}

TEST(DecaysFirst, AGapIsFollowedToNoiseOfAColour) {
  Laboratory pink;
  pink.noise = NoiseKind::pink;
  pink.share = 0.7;
  const Hidden hidden = hide("freeplay", 702, 20, pink);
  Trial trial = prepare(*hidden.problem, hidden.baseline, {"freeplay"});
  ASSERT_TRUE(fit_decays_first(trial, hidden.baseline));
  EXPECT_TRUE(trial.decays.exactly);
  EXPECT_GT(trial.decays.chi2, 1.5) << "otherwise this campaign tests nothing of the colour";
  EXPECT_FALSE(trial.decays.noise.empty());
  follow_further(trial, INFINITY);
  EXPECT_FALSE(has_colour(trial.arrival.joint)) << "the noise is as it was behind the search, for evidence is told in one noise";
  EXPECT_NEAR(unknowns_of(trial.arrival.joint, "freeplay").front()->value / hidden.parameters.front(), 1, 0.04) << "as in white noise";
}

TEST(DecaysFirst, WhatARunHasToItselfStaysWhenTheRigGoesBack) {
  // In stall the normal-force slope is less than half of the rig file's, and no mistake.
  const Hidden hidden = hide("freeplay", 702, 20);
  JointProblem joint = hidden.baseline.arrival.joint;
  const VectorXd rig = joint.model().start_values();
  const auto value_of = [&](const char* name, int run) -> double& {
    for (Unknown& u : joint.unknowns())
      if (joint.parameter(u).name == name && u.run == run) return u.value;
    throw std::out_of_range(name);
  };
  const double slope = 0.4 * rig[joint.model().index("normal_force_slope")], damping = rig[joint.model().index("torsion.damping_ratio")];
  value_of("normal_force_slope", 4) = slope;
  value_of("torsion.damping_ratio", -1) = 10 * damping;
  EXPECT_TRUE(back_to_the_rig(joint, 2));
  EXPECT_EQ(value_of("normal_force_slope", 4), slope);
  EXPECT_EQ(value_of("torsion.damping_ratio", -1), damping);
  EXPECT_FALSE(back_to_the_rig(joint, 2));
}

/// A model that runs away from its start leaves nothing to search: all its unknowns are held.
TEST(DecaysFirst, NothingFreeIsNothingToSearch) {
  const Hidden hidden = hide("coulomb-friction", 702, 4);
  Trial trial = prepare(*hidden.problem, hidden.baseline, {"coulomb-friction"});
  for (Unknown& u : trial.arrival.joint.unknowns()) u.held = true;
  EXPECT_GT(fit_decays(trial.arrival.joint, "coulomb-friction").chi2, 1.15) << "what counts as explained";
}

TEST(DecaysFirst, FrictionThatStopsTheRigIsFoundFromARigThatIsFarOff) {
  // Without friction the fit reads its decay as strong damping. The campaign is simulated in quarter samples.
  const Hidden hidden = hide("coulomb-friction", 6, 0);
  ASSERT_GT(hidden.baseline.reduced_chi2(), 50);
  Trial trial = prepare(*hidden.problem, hidden.baseline, {"coulomb-friction"});
  EXPECT_LT(fit_decays(trial.arrival.joint, "coulomb-friction").chi2, 1.15) << "what counts as explained";
  // 0.03 N of noise on some ten Newton over 2500 samples tell the force better than to a hundredth.
  EXPECT_NEAR(unknowns_of(trial.arrival.joint, "coulomb-friction").front()->value / hidden.parameters.front(), 1, 0.01);
}

/// From a force of twice and a displacement of half of what was hidden, of the shape of neither. A memory that is not followed along the trajectory grows like the displacement over that at which it yields.
TEST(DecaysFirst, HysteresisIsFoundFromSizesThatAreFarOff) {
  for (const unsigned seed : {11u, 12u, 13u}) {
    const Hidden hidden = hide("bouc-wen", seed, 0);
    ASSERT_GT(hidden.baseline.reduced_chi2(), 10) << seed;
    Trial trial = prepare(*hidden.problem, hidden.baseline, {"bouc-wen"});
    const std::vector<Unknown*> own = unknowns_of(trial.arrival.joint, "bouc-wen");
    ASSERT_EQ(own.size(), 4u);
    const double start[] = {2 * hidden.parameters[0], 0.5 * hidden.parameters[1], 0.5, 0.5};
    for (std::size_t i = 0; i < own.size(); ++i) own[i]->value = start[i];
    EXPECT_LT(fit_decays(trial.arrival.joint, "bouc-wen", true).chi2, 1.15) << "what counts as explained, seed " << seed;
  }
}

/// `unrig fit --effect` from the rig file: a spring that stiffens so much that the fit without it leaves 80 times the noise of the decays and more.
TEST(DecaysFirst, AFitWithAStrongSpringNamedArrives) {
  constexpr unsigned seed = 5, trial = 19;
  const Hidden hidden = hide("cubic-stiffness", seed, trial);
  ASSERT_GT(hidden.baseline.reduced_chi2(), 1000);
  FitProblem problem = *hidden.problem;
  problem.effects = {"cubic-stiffness"};
  const FitResult result = fit(problem);
  EXPECT_EQ(result.no_answer, "");
  for (const FittedRun& run : result.runs) EXPECT_TRUE(run.explained()) << run.file << " " << run.reduced_chi2();
  for (const FittedParameter& p : result.parameters) {
    if (p.name != "cubic-stiffness.coefficient") continue;
    EXPECT_NEAR(p.value, hidden.parameters.front(), 4 * p.std_error);
    EXPECT_LT(p.std_error, 0.01 * p.value);
  }
}

/// What is not measured would rank before all that is.
TEST(DecaysFirst, StaticDisplacementsThatNoRunAsksForAreLeftOut) {
  const Hidden hidden = hide("cubic-stiffness", 8, 1);  // hidden without any
  Trial trial = prepare(*hidden.problem, hidden.baseline, {"cubic-stiffness"});
  ASSERT_TRUE(follow_nonlinear(*hidden.problem, trial, hidden.baseline, INFINITY));
  ASSERT_TRUE(leaves_nothing(trial)) << trial.reduced_chi2();
  for (Unknown* u : unknowns_of(trial.arrival.joint, "cubic-stiffness")) u->held = false;
  settle(trial);
  Trial fewer = trial;
  leave_out_terms(fewer);
  EXPECT_LT(bic_difference(fewer, trial), -10) << "three steps have one each, of which the logarithm of all samples counts";
  const std::vector<Unknown*> own = unknowns_of(fewer.arrival.joint, "cubic-stiffness");
  ASSERT_EQ(own.size(), 4u);
  for (const Unknown* u : own) EXPECT_EQ(u->held, u->run >= 0) << fewer.arrival.joint.name(*u);
}

TEST(DecaysFirst, DecaysAloneUnderAGapAreMeasured) {
  FitProblem problem;
  problem.rig = read_rig(test::null_campaign("rig.toml"));
  for (const std::string name : {"dry_pluck.csv", "wet_pluck.csv"}) problem.runs.push_back(read_run(test::null_campaign(name)));
  const Trial base = fit_baseline(problem);
  Trial gap = prepare(problem, base, {"freeplay"});
  ASSERT_TRUE(decays_decide(gap));
  follow_further(gap, INFINITY);
  EXPECT_EQ(gap.variance.size(), problem.runs.size());
}

}  // namespace
}  // namespace unrig
