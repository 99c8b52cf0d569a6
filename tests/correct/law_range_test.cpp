// A law of the fit, and a run that takes it beyond where it was learnt.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <string>

#include <fmt/format.h>

#include "core/files/error.h"
#include "core/law/law_effect.h"
#include "core/model/simulate.h"
#include "fit/likelihood/shaft_motion.h"
#include "tests/correct/null_campaign.h"

namespace unrig {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::Not;

/// The null campaign's fit with a drag that is hardly felt, learnt up to some velocity [m/s].
CorrectProblem problem_learnt_to(double velocity) {
  CorrectProblem problem = test::null_problem("step_a");
  for (Channel& c : problem.run.channels) c.value.conservativeResize(900);
  const std::string range = velocity > 0 ? fmt::format("[learnt_on]\nv = [\"{} m/s\", \"{} m/s\"]\n", -velocity, velocity) : "";
  Rig rig;
  add_law(rig, parse_law("unrig_law = 1\nname = \"drag\"\nacts_on = \"normal\"\nforce = \"-c * abs(v) * v\"\n[parameters]\nc = { start = \"1e-6 N.s^2/m^2\" }\n" + range, "law.toml"));
  problem.fit.laws = rig.laws;
  problem.fit.effects = {"law:drag"};
  FittedParameter c;
  c.name = "law:drag.c";
  c.value = 1e-6, c.std_error = 1e-9;
  problem.fit.parameters.push_back(c);
  const auto n = static_cast<Eigen::Index>(problem.fit.parameters.size());
  Eigen::MatrixXd correlation = Eigen::MatrixXd::Identity(n, n);
  correlation.topLeftCorner(n - 1, n - 1) = problem.fit.correlation;
  problem.fit.correlation = correlation;
  return problem;
}

/// Largest velocity of the rig in that motion, by the simulation of the fitted model.
double simulated_velocity(const CorrectProblem& problem) {
  const AeroelasticModel model = AeroelasticModel(with_laws(problem.rig, problem.fit), make_basis(problem.rig, problem.fit.normal_modes, problem.fit.torsion_modes), wagner(problem.fit.circulation)).with_effects({"law:drag"});
  const auto motion = shaft_motion(problem.rig, problem.run);
  unrig::Run run = problem.run;
  for (Channel& channel : run.channels)
    if (channel.name == "alpha") channel.value = motion->angle;
  const SimulateResult result = simulate({model, theta_for(model, problem.fit, run.file), run, {}, {}, {}});
  double lower = 0, upper = 0;
  const std::string said = result.beyond.empty() ? "" : result.beyond.front();
  EXPECT_EQ(std::sscanf(said.substr(std::min(said.size(), said.find("; here"))).c_str(), "; here v is from %lf to %lf m/s", &lower, &upper), 2) << said;
  return std::max(-lower, upper);
}

TEST(LawRange, IsHeldAgainstTheEstimatedTrajectory) {
  const double reached = simulated_velocity(problem_learnt_to(1e-9));
  ASSERT_GT(reached, 1e-4);
  EXPECT_THAT(correct(problem_learnt_to(reached)).warnings, Not(Contains(HasSubstr("learnt"))));
  EXPECT_THAT(correct(problem_learnt_to(0)).warnings, Not(Contains(HasSubstr("learnt")))) << "a law that does not say";
  CorrectProblem beyond = problem_learnt_to(0.8 * reached);  // 10 % are let pass
  try {
    correct(beyond);
    ADD_FAILURE() << "corrected";
  } catch (const NoAnswer& e) {
    EXPECT_THAT(e.what(), ::testing::AllOf(HasSubstr("step_a.csv: the law \"drag\" was learnt where v is from -"), HasSubstr("beyond for the first time at"), HasSubstr("--beyond")));
  }
  beyond.beyond = true;
  EXPECT_THAT(correct(beyond).warnings, Contains(HasSubstr("Beyond, a law is a guess")));
}

}  // namespace
}  // namespace unrig
