#include "core/law/learnt_range.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "core/files/error.h"
#include "core/law/law_effect.h"
#include "core/model/simulate.h"
#include "tests/support/sample_data.h"

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::VectorXd;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

std::string file_of(const std::string& acts_on, const std::string& force, const std::string& parameters, const std::string& learnt_on) {
  return "unrig_law = 1\nname = \"mine\"\nacts_on = \"" + acts_on + "\"\nforce = \"" + force + "\"\n[parameters]\n" + parameters + "[learnt_on]\n" + learnt_on;
}

constexpr double mass = 2, load = 20, pi = 3.14159265358979324;
const double stiffness = mass * std::pow(2 * pi * 5, 2);

/// A free decay of a rig of one undamped mode, let go from rest; the gauge reads its displacement.
SimulateResult decay(const std::string& force, const std::string& parameters, const std::string& learnt_on, double gain = 1) {
  Rig rig;
  rig.file = "rig.toml";
  rig.modal = {{mass, 5, 0, gain, "m"}};
  add_law(rig, parse_law(file_of("normal", force, parameters, learnt_on), "law.toml"));
  unrig::Run run;
  run.file = "run.csv";
  run.kind = RunKind::pluck;
  run.start = 10;
  run.dt = 1e-3;
  run.channels = {{"gauge", "m", "m", 1, VectorXd::Zero(1000), 0}};
  SimulateProblem problem{AeroelasticModel(rig, {}, {}).with_effects({"law:mine"}), {}, run, {}, {}, {}};
  problem.theta = problem.model.start_values();
  problem.release_load = load;
  return simulate(problem);
}

/// From x0 = load / k the decay swings between x0 and -x0, and its velocity between w x0 and -w x0; a hardly felt cubic spring changes neither.
TEST(LearntRange, IsHeldAgainstTheTrajectory) {
  const std::string k = "k = { start = \"1e-3 N/m^3\" }\n";
  const double x0 = load / stiffness, w = 2 * pi * 5;
  const auto from_to = [](double lower, double upper, const std::string& unit) { return "[\"" + std::to_string(lower) + " " + unit + "\", \"" + std::to_string(upper) + " " + unit + "\"]\n"; };
  EXPECT_THAT(decay("-k * x^3 * (1 + v)", k, "").beyond, IsEmpty()) << "a law that does not say";
  EXPECT_THAT(decay("-k * x^3 * (1 + v)", k, "x = " + from_to(-x0, x0, "m") + "v = " + from_to(-w * x0, w * x0, "m/s")).beyond, IsEmpty());
  EXPECT_THAT(decay("-k * x^3", k, "x = " + from_to(-x0, 0.97 * x0, "m")).beyond, IsEmpty()) << "3 % of half the width";
  const std::vector<std::string> beyond = decay("-k * x^3 * (1 + v)", k, "x = " + from_to(-x0, 2 * x0, "m") + "v = " + from_to(-0.5 * w * x0, w * x0, "m/s")).beyond;
  ASSERT_EQ(beyond.size(), 1u);
  double lower = 0, upper = 0, reached_lower = 0, reached_upper = 0, first = 0;
  ASSERT_EQ(std::sscanf(beyond[0].c_str(), "the law \"mine\" was learnt where v is from %lf to %lf m/s; here v is from %lf to %lf m/s, beyond for the first time at %lf s", &lower, &upper, &reached_lower, &reached_upper, &first), 5) << beyond[0];
  EXPECT_NEAR(lower / (-0.5 * w * x0), 1, 5e-3);
  EXPECT_NEAR(reached_lower / (-w * x0), 1, 5e-3);
  EXPECT_NEAR(reached_upper / (w * x0), 1, 5e-3);
  // v = -w x0 sin w t passes the end of the range and 5 % of its width, 1.5 w x0, at sin w t = 0.575; the record begins at 10 s.
  EXPECT_NEAR(first, 10 + std::asin(0.575) / w, 1.1e-3);
}

/// An added mass is solved for, and stands in no force that is followed; what it looks at is known all the same: from rest, a(0) = -load / (m + added).
TEST(LearntRange, KnowsTheAccelerationOfAnAddedMass) {
  const std::vector<std::string> beyond = decay("-m * a", "m = { start = \"0.5 kg\" }\n", "a = [\"-1 m/s^2\", \"1 m/s^2\"]\n").beyond;
  ASSERT_EQ(beyond.size(), 1u);
  double lower = 0, upper = 0, first = 0;
  ASSERT_EQ(std::sscanf(beyond[0].c_str(), "the law \"mine\" was learnt where a is from -1 to 1 m/s^2; here a is from %lf to %lf m/s^2, beyond for the first time at %lf s", &lower, &upper, &first), 3) << beyond[0];
  EXPECT_NEAR(lower, -load / (mass + 0.5), 0.01);
  EXPECT_EQ(first, 10);
}

TEST(LearntRange, KnowsTheTimeInTheRun) {
  const std::string c = "c = { start = \"1e-3 N\" }\n";
  EXPECT_THAT(decay("c * t * x / (1 + abs(x))", c, "t = [\"0 s\", \"0.96 s\"]\n").beyond, IsEmpty());
  EXPECT_THAT(decay("c * t * x / (1 + abs(x))", c, "t = [\"0 s\", \"0.5 s\"]\n").beyond, ElementsAre(HasSubstr("t is from 0 to 0.999 s, beyond for the first time at 10.53 s")));
}

/// Of a beam in a step: the angle is the shaft's in full, and a lift law, which acts on every strip, is told once.
TEST(LearntRange, KnowsTheAngleAndTheStrips) {
  const std::string campaign = "sample_data/campaigns/null/";
  Rig rig = read_rig(test::source_path(campaign + "rig.toml"));
  add_law(rig, parse_law(file_of("lift", "c * theta^3", "c = { start = \"1e-6 N\" }\n", "theta = [\"0 deg\", \"1 deg\"]\n"), "law.toml"));
  unrig::Run run = read_run(test::source_path(campaign + "step_a.csv"));
  const VectorXd& alpha = run.channel("alpha").value;
  const AeroelasticModel model = AeroelasticModel(rig, make_basis(rig, Index{2}, Index{1}), wagner(Wagner::jones)).with_effects({"law:mine"});
  const SimulateResult result = simulate({model, model.start_values(), run, {}, {}, {}});
  ASSERT_EQ(result.beyond.size(), 1u);
  double lower = 0, upper = 0, first = 0;
  ASSERT_EQ(std::sscanf(result.beyond[0].c_str(), "the law \"mine\" was learnt where theta is from 0 to 0.0175 rad; here theta is from %lf to %lf rad, beyond for the first time at %lf s", &lower, &upper, &first), 3) << result.beyond[0];
  const double level = conditions_of(run).onset_angle - alpha[0];  // the spline begins at the first reading, the model at the level before the motion
  EXPECT_NEAR(upper, alpha.maxCoeff() + level, 1e-3 * upper);
  EXPECT_NEAR(lower, alpha.minCoeff() + level, 1e-3 * upper);
  Index k = 0;
  while (std::abs(alpha[k] + level) <= 1.05 * pi / 180) ++k;
  EXPECT_NEAR(first, run.time(k), 1.5 * run.dt);
}

TEST(LearntRange, IsRefusedOrWarnedOf) {
  std::vector<std::string> warnings;
  refuse_beyond({}, "run.csv", false, warnings);
  EXPECT_THAT(warnings, IsEmpty());
  refuse_beyond({"the law is asked too much"}, "run.csv", true, warnings);
  EXPECT_THAT(warnings, ElementsAre(HasSubstr("run.csv: the law is asked too much. Beyond, a law is a guess.")));
  EXPECT_THROW(refuse_beyond({"the law is asked too much"}, "run.csv", false, warnings), NoAnswer);
}

TEST(LearntRange, IsRoundedOutward) {
  const Range range = rounded_outward({-0.00401234567, 0.0050321111});
  EXPECT_DOUBLE_EQ(range.lower, -0.004013);
  EXPECT_DOUBLE_EQ(range.upper, 0.005033);
  const Range as_they_are = rounded_outward({0, 25});
  EXPECT_EQ(as_they_are.lower, 0);
  EXPECT_EQ(as_they_are.upper, 25);
}

}  // namespace
}  // namespace unrig
