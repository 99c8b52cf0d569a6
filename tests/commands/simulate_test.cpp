#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <string>

#include "core/run/run.h"
#include "tests/commands/unrig.h"

namespace unrig::test {
namespace {

using testing::HasSubstr;
using testing::Not;

const std::string seed = std::string(UNRIG_SOURCE_DIR) + "/sample_data/seed/";

class SimulateCommand : public testing::Test {
 protected:
  Outcome simulate(const std::string& arguments) { return unrig("simulate " + arguments, directory_); }
  std::string output() const { return directory_.path("out.csv"); }
  std::string rig_and_step() const { return "--rig " + seed + "rig.toml --run " + seed + "step.csv -o " + output() + " "; }

  TemporaryDirectory directory_;
};

/// In the rig that the campaign was simulated with, the noise of the angle alone would shake the gauge by a newton, thirty times its noise.
TEST_F(SimulateCommand, AMeasuredAngleIsTakenForTheMotionThatItSays) {
  const std::string campaign = std::string(UNRIG_SOURCE_DIR) + "/sample_data/campaigns/null/";
  const std::string arguments = "--rig " + campaign + "rig.toml --run " + campaign + "step_a.csv -o " + output() + " --set normal.stiffness_scale=0.7887 --set torsion.stiffness_scale=0.8014 " +
                                "--set normal.damping_ratio=0.00812 --set torsion.damping_ratio=0.0272 --set apparent_mass_coefficient=1.1219 --set normal_force_slope=5.8636 ";  // KEY.json
  const auto apart = [&](const std::string& options) {
    const Outcome done = simulate(arguments + options);
    EXPECT_EQ(done.status, 0) << done.err;
    EXPECT_THAT(done.err, HasSubstr(options.empty() ? "simulated is the smooth motion that it says" : "alpha carries noise")) << options;
    const Eigen::VectorXd difference = read_run(campaign + "step_a.csv").channel("gauge").value - read_run(output()).channel("gauge").value;
    return std::sqrt((difference.array() - difference.mean()).square().mean());
  };
  EXPECT_LT(apart(""), 1.2 * 0.0272);
  EXPECT_GT(apart("--as-recorded"), 0.5);
}

TEST_F(SimulateCommand, WritesARunThatReadsBack) {
  const Outcome done = simulate(rig_and_step());
  EXPECT_EQ(done.status, 0) << done.err;
  EXPECT_THAT(done.out, HasSubstr("3201 samples of 0.0005 s"));
  EXPECT_THAT(done.out, HasSubstr("resonance"));
  const unrig::Run in = read_run(seed + "step.csv"), out = read_run(output());
  EXPECT_EQ(out.samples(), in.samples());
  EXPECT_EQ(out.name, in.name);
  EXPECT_NEAR(out.speed, in.speed, 1e-12);
  EXPECT_NEAR(out.density / in.density, 1, 1e-11) << "twelve digits";
  EXPECT_LT((out.channel("alpha").value - in.channel("alpha").value).cwiseAbs().maxCoeff(), 1e-11);
  for (const char* column : {"gauge", "tip_displacement", "tip_twist", "circulatory", "normal_force"})
    EXPECT_TRUE(out.find(column)) << column;

  // And may go in again.
  const Outcome again = simulate("--rig " + seed + "rig.toml --run " + output() + " -o " + directory_.path("again.csv"));
  EXPECT_EQ(again.status, 0) << again.err;
  EXPECT_EQ(read_run(directory_.path("again.csv")).channels.size(), out.channels.size());
}

TEST_F(SimulateCommand, OptionsReachTheModel) {
  const auto gauge = [&](const std::string& options) {
    const Outcome done = simulate(rig_and_step() + options);
    EXPECT_EQ(done.status, 0) << done.err;
    return Eigen::VectorXd(read_run(output()).channel("gauge").value);
  };
  const Eigen::VectorXd plain = gauge("");
  for (const char* options : {"--wagner jones", "--modes 3", "--torsion-modes 2",
                              "--set apparent_mass_coefficient=1.1 --set normal_force_slope=5", "--set steady_normal_force=0.3", "--jumps"})
    EXPECT_GT((gauge(options) - plain).cwiseAbs().maxCoeff(), 1e-6) << options;
  EXPECT_EQ((gauge("--modes 1 --wagner 1e-4 --set normal_force_slope=6.283185307179586") - plain).norm(), 0) << "the defaults, said aloud";
}

TEST_F(SimulateCommand, TakesParametersFromAFit) {
  const std::string fit = directory_.file("fit.json", R"({"unrig": "fit", "circulation": "jones", "modes": {"normal": 2, "torsion": 1},
      "parameters": [{"name": "normal.stiffness_scale", "value": 0.8, "std_error": 0.01, "unit": "1"},
                     {"name": "normal_force_slope", "value": 5.0, "std_error": 0.1, "unit": "1/rad", "run": "other/step.csv"},
                     {"name": "steady_normal_force", "value": 0.21, "std_error": null, "unit": "1", "run": "step.csv"}]})");
  const Outcome fitted = simulate(rig_and_step() + "--fit " + fit);
  ASSERT_EQ(fitted.status, 0) << fitted.err;
  const Eigen::VectorXd gauge = read_run(output()).channel("gauge").value;
  const Outcome by_hand =
      simulate(rig_and_step() +
               "--modes 2 --wagner jones --set normal.stiffness_scale=0.8 --set normal_force_slope=5 --set steady_normal_force=0.21");
  ASSERT_EQ(by_hand.status, 0) << by_hand.err;
  EXPECT_EQ((read_run(output()).channel("gauge").value - gauge).norm(), 0);
}

TEST_F(SimulateCommand, TheFitOfAnotherRigIsRefused) {
  const std::string fit = directory_.file("fit.json", R"({"unrig": "fit", "circulation": "jones", "parameters": [{"name": "modal[1].mass", "value": 2, "std_error": 0.1, "unit": "kg"}]})");
  const Outcome outcome = simulate(rig_and_step() + "--fit " + fit);
  EXPECT_EQ(outcome.status, 2);
  EXPECT_THAT(outcome.err, HasSubstr("no parameter of the rig"));
  EXPECT_FALSE(std::filesystem::exists(output()));
}

TEST_F(SimulateCommand, PluckNeedsAndTakesAReleaseLoad) {
  const std::string pluck = std::string(UNRIG_SOURCE_DIR) + "/sample_data/campaigns/null/dry_pluck.csv";
  const std::string arguments = "--rig " + seed + "rig_from_drawings.toml --run " + pluck + " -o " + output();
  const Outcome without = simulate(arguments);
  EXPECT_EQ(without.status, 2);
  EXPECT_THAT(without.err, HasSubstr("release-load"));
  const Outcome with = simulate(arguments + " --modes 17 --release-load '3 lbf'");
  ASSERT_EQ(with.status, 0) << with.err;
  EXPECT_NEAR(read_run(output()).channel("gauge").value[0], 3 * 4.4482216152605, 1e-5) << "all modes, ten printed digits";
}

TEST_F(SimulateCommand, WrongUseEndsWithTwoAndWritesNothing) {
  const struct {
    std::string arguments, says;
  } rows[] = {
      {"", "--rig is required"},
      {rig_and_step() + "--wagner theodorsen", "jones"},
      {rig_and_step() + "--set apparent_mas=1", "apparent_mass_coefficient"},
      {rig_and_step() + "--set apparent_mass_coefficient", "name=value"},
      {rig_and_step() + "--set apparent_mass_coefficient=one", "finite number"},
      {rig_and_step() + "--set apparent_mass_coefficient=nan", "finite number"},
      {rig_and_step() + "--modes 40", "modes"},
      {rig_and_step() + "--modes 0", "modes"},
      {rig_and_step() + "--release-load '2 kg'", "release load"},
      {rig_and_step() + "--release-load '2 N'", "a release load for a step"},
      {rig_and_step() + "--fit " + seed + "rig.toml", "fit.json"},
      {"--rig " + seed + "rig.toml --run " + seed + "rig.toml -o " + output(), "this is a rig file; wanted a run file"},
      {"--rig nowhere.toml --run " + seed + "step.csv -o " + output(), "nowhere.toml"},
      {"--rig " + seed + "rig.toml --run " + seed + "step.csv -o /nowhere/out.csv", "/nowhere/out.csv"},
  };
  for (const auto& row : rows) {
    const Outcome outcome = simulate(row.arguments);
    EXPECT_EQ(outcome.status, 2) << row.arguments;
    EXPECT_THAT(outcome.err, HasSubstr(row.says)) << row.arguments;
    EXPECT_THAT(outcome.err, Not(HasSubstr("internal error"))) << row.arguments;
    EXPECT_FALSE(std::filesystem::exists(output())) << row.arguments;
  }
}

TEST_F(SimulateCommand, OptionsThatCannotActAreRefused) {
  const std::string rig = directory_.file(
      "rig.toml", "unrig_rig = 1\n[[modal]]\nmass = \"2 kg\"\nfrequency = \"5 Hz\"\ndamping_ratio = 0.1\ngauge_gain = \"1000 N/m\"\n");
  const std::string forced = directory_.file(
      "forced.csv",
      "# unrig_run = 1\n# kind = \"forced\"\n# density = \"1 kg/m^3\"\n# speed = \"0 m/s\"\ntime [s],force [N]\n0,1\n0.1,1\n0.2,1\n");
  const std::string arguments = "--rig " + rig + " --run " + forced + " -o " + output();
  EXPECT_EQ(simulate(arguments + " --modes 1").status, 2);
  EXPECT_EQ(simulate(arguments + " --wagner jones").status, 2);
  EXPECT_EQ(simulate(arguments + " --set 'modal[1].damping=3'").status, 0);
}

TEST_F(SimulateCommand, HelpNamesEveryOption) {
  const Outcome help = simulate("--help");
  EXPECT_EQ(help.status, 0);
  for (const char* option : {"--rig", "--run", "--fit", "--wagner", "--modes", "--torsion-modes", "--set", "--release-load", "--jumps"})
    EXPECT_THAT(help.out, HasSubstr(option));
}

}  // namespace
}  // namespace unrig::test
