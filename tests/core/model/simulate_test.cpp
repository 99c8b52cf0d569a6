#include "core/rig/bridge.h"
#include "core/model/simulate.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <string>

#include "core/rig/rig.h"
#include "core/run/run_text.h"
#include "core/files/text_file.h"
#include "tests/support/temporary_directory.h"

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::VectorXd;
using std::numbers::pi;
using testing::ElementsAre;
using testing::HasSubstr;

std::string sample(const std::string& file) { return std::string(UNRIG_SOURCE_DIR) + "/sample_data/" + file; }

std::string meta_data(const std::string& kind, const std::string& speed) {
  return "# unrig_run = 1\n# kind = \"" + kind + "\"\n# density = \"998.2 kg/m^3\"\n# speed = \"" + speed + "\"\n";
}

AeroelasticModel model_of(const std::string& rig_file, Index normal_modes) {
  const Rig rig = read_rig(sample(rig_file));
  return {rig, make_basis(rig, normal_modes, Index{1}), wagner(Wagner::within_1e4)};
}

SimulateProblem problem(AeroelasticModel model, Run run) {
  const VectorXd theta = model.start_values();
  return {std::move(model), theta, std::move(run), {}, {}, {}};
}

std::string message_of(const SimulateProblem& p) {
  try {
    simulate(p);
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

double largest_difference(const Run& run, const std::string& a, const std::string& b) {
  return (run.channel(a).value - run.channel(b).value).cwiseAbs().maxCoeff();
}

class Simulate : public testing::Test {
 protected:
  unrig::Run run(const std::string& text) { return read_run(directory_.file("run.csv", text)); }

  /// A smooth step of 2 deg from 1 deg, 400 samples of 1 ms.
  unrig::Run step() {
    std::string text = meta_data("step", "0.6 m/s") + "time [s],alpha [deg],note [1]\n";
    for (int k = 0; k < 400; ++k) {
      const double x = std::clamp((k - 100) / 40.0, 0.0, 1.0);
      text +=
          std::to_string(k * 1e-3) + "," + std::to_string(1 + 2 * x * x * x * (10 + x * (6 * x - 15))) + "," + std::to_string(k % 7) + "\n";
    }
    return run(text);
  }

  test::TemporaryDirectory directory_;
};

TEST_F(Simulate, MeetsASimulatorThatSharesNoCodeWithIt) {
  // campaigns/null with its answers (campaigns/KEY.json): five normal modes and one torsional. The truth's angle is printed to 1e-5 deg,
  // its loads to 1e-5 N; rounding of the angle comes back in its derivatives: 7.0e-4 N of the gauge, 2.9e-3 N of the circulation measured,
  // rounded up.
  const std::string truth = read_text(sample("campaigns/null/truth_step_a.csv"));
  const std::size_t header = truth.find('\n');
  const unrig::Run recorded = run(meta_data("step", "0.6096 m/s") +
                                  "time [s],alpha [deg],true_gauge [N],true_circulatory [N],true_normal_force [N]" + truth.substr(header));
  SimulateProblem p = problem(model_of("campaigns/null/rig.toml", 5), recorded);
  const auto set = [&](const char* name, double value) { p.theta[p.model.index(name)] = value; };
  set("normal.stiffness_scale", 0.7886982855975505);
  set("torsion.stiffness_scale", 0.8013562073631658);
  set("normal.damping_ratio", 0.008116058148283655);
  set("torsion.damping_ratio", 0.027202192423294178);
  set("apparent_mass_coefficient", 1.1219030719225085);
  set("normal_force_slope", 5.863641575002156);
  const SimulateResult result = simulate(p);
  EXPECT_THAT(result.simulated, ElementsAre("gauge", "circulatory", "normal_force"));
  EXPECT_LT(largest_difference(result.run, "gauge", "true_gauge"), 1e-3);
  EXPECT_LT(largest_difference(result.run, "circulatory", "true_circulatory"), 3e-3);
}

TEST_F(Simulate, StepStartsAndEndsSteady) {
  const SimulateResult result = simulate(problem(model_of("seed/rig_from_drawings.toml", 4), step()));
  const auto per_degree = [&](const std::string& column, Index k) { return result.run.channel(column).value[k]; };
  const Rig rig = read_rig(sample("seed/rig_from_drawings.toml"));
  const double reading = reading_of_unit_coefficient(rig, gauge_levers(rig), 998.2, 0.6) * 2 * pi * pi / 180;
  EXPECT_NEAR(per_degree("gauge", 0), reading, 1e-9 * reading) << "2 pi per radian, at 1 deg";
  EXPECT_NEAR(per_degree("normal_force", 0), reading, 1e-9 * reading) << "three strips about the calibration element";
  EXPECT_NEAR(per_degree("tip_twist", 0), pi / 180, 1e-12) << "the load acts on the pitch axis";
  EXPECT_GT(per_degree("tip_displacement", 0), 0);
  EXPECT_NEAR(per_degree("tip_twist", 50), pi / 180, 1e-12) << "nothing moves before the step, but for the spline's ringing, 0.27^50";
  EXPECT_EQ(result.run.channel("note").value, step().channel("note").value) << "untouched";
  EXPECT_EQ(result.run.channel("tip_twist").unit, "rad");
  EXPECT_TRUE(result.warnings.empty());
}

TEST_F(Simulate, SteadyNormalForceReplacesTheLinearOne) {
  Rig rig = read_rig(sample("seed/rig_from_drawings.toml"));
  Sensor shear;
  shear.column = "shear";
  shear.reads = SensorKind::load;
  shear.element = 2;
  shear.row.per_force = 1;
  shear.unit = "N";
  rig.sensors.push_back(shear);
  SimulateProblem p = problem({rig, make_basis(rig, Index{2}, Index{1}), wagner(Wagner::within_1e4)}, step());
  const unrig::Run linear = simulate(p).run;
  p.steady_normal_force = 0.5;
  const unrig::Run given = simulate(p).run;
  const double unit = reading_of_unit_coefficient(p.model.rig(), gauge_levers(p.model.rig()), 998.2, 0.6);
  EXPECT_NEAR(given.channel("gauge").value[0], 0.5 * unit, 1e-12 * unit);
  const double load = 0.5 * 998.2 * 0.6 * 0.6 * rig.semichord() * 3 * rig.strip_length;
  EXPECT_NEAR(given.channel("shear").value[0], load, 1e-12 * load) << "a bridge inboard of all strips";
  EXPECT_EQ(given.channel("tip_displacement").value, linear.channel("tip_displacement").value);
  const VectorXd shift = given.channel("gauge").value - linear.channel("gauge").value;
  EXPECT_LT((shift.array() - shift[0]).abs().maxCoeff(), 1e-12 * unit) << "a constant of the run";
}

TEST_F(Simulate, JumpsAreIdealSteps) {
  // A fast ramp tends to it; after the first instants half the ramp makes a quarter of the difference (tests/core/model/ideal_step_test.cpp), and
  // a ramp over one sample in a thousand is close. Here: the jump's own end.
  std::string text = meta_data("step", "0.6 m/s") + "time [s],alpha [deg]\n";
  for (int k = 0; k < 60000; ++k) text += std::to_string(k * 1e-3) + (k < 10 ? ",1\n" : ",3\n");
  SimulateProblem p = problem(model_of("seed/rig_from_drawings.toml", 2), run(text));
  p.pitch = PitchBetweenSamples::jumps;
  const unrig::Run jumped = simulate(p).run;
  const VectorXd& gauge = jumped.channel("gauge").value;
  EXPECT_NEAR(gauge[9] / gauge[0], 1, 1e-12) << "before the jump nothing happens";
  EXPECT_GT(std::abs(gauge[10] / gauge[0] - 1), 1) << "the sample at the jump is its limit from the right";
  EXPECT_NEAR(gauge[59999] / gauge[0], 3, 0.02) << "60 s are 470 semichords: 1 - phi is 0.002";
  EXPECT_NEAR(jumped.channel("normal_force").value[10] / jumped.channel("normal_force").value[9], 1 + 2 * (0.5 + 0.125), 3e-3)
      << "rigid: half of the steady increase at once, an eighth more for the pitch rate that was; 0.1237 in the approximation's slope";
}

TEST_F(Simulate, PluckStartsFromItsReleaseLoad) {
  std::string text = meta_data("pluck", "0 m/s") + "time [s],gauge [lbf]\n";
  for (int k = 0; k < 1000; ++k) text += std::to_string(k * 1e-3) + ",0\n";
  SimulateProblem p = problem(model_of("seed/rig_from_drawings.toml", 17), run(text));
  p.release_load = 20;
  const SimulateResult result = simulate(p);
  const Channel& gauge = result.run.channel("gauge");
  EXPECT_NEAR(gauge.value[0], 20, 1e-6) << "just after the release the rig's inertia takes the load's place: all modes, round-off";
  EXPECT_LT(gauge.value.tail(200).cwiseAbs().maxCoeff(), gauge.value.head(200).cwiseAbs().maxCoeff()) << "and it decays";
  EXPECT_EQ(gauge.file_unit, "lbf") << "a recorded column keeps its unit";
  EXPECT_THAT(run_text(result.run), HasSubstr("gauge [lbf]"));
  EXPECT_THAT(result.simulated, ElementsAre("gauge", "tip_displacement", "tip_twist")) << "no load without a stream of given pitch";
}

TEST_F(Simulate, ForcedRigFollowsItsForce) {
  // Far below the first resonance the gauge reads the force at the calibration element itself.
  std::string text = meta_data("forced", "0 m/s") + "time [s],force [N]\n";
  for (int k = 0; k < 4000; ++k) text += std::to_string(k * 0.01) + "," + std::to_string(5 * (1 - std::exp(-k * 0.001))) + "\n";
  const unrig::Run forced = simulate(problem(model_of("seed/rig_from_drawings.toml", 1), run(text))).run;
  EXPECT_LT((forced.channel("gauge").value - forced.channel("force").value).tail(2000).cwiseAbs().maxCoeff(), 0.01);
}

TEST_F(Simulate, ModalRigAnswersAForce) {
  const std::string rig_file = directory_.file(
      "rig.toml", "unrig_rig = 1\n[[modal]]\nmass = \"2 kg\"\nfrequency = \"5 Hz\"\ndamping_ratio = 0.5\ngauge_gain = \"1000 N/m\"\n");
  std::string text = meta_data("forced", "0 m/s") + "time [s],force [N]\n";
  for (int k = 0; k < 3000; ++k) text += std::to_string(k * 1e-3) + ",3\n";
  const Rig rig = read_rig(rig_file);
  const unrig::Run forced = simulate(problem({rig, {}, wagner(Wagner::jones)}, run(text))).run;
  EXPECT_NEAR(forced.channel("gauge").value[2999], 1000 * 3 / (2 * std::pow(2 * pi * 5, 2)), 1e-9) << "static: gain F / k";
}

TEST_F(Simulate, RefusesWhatItCannotAnswer) {
  unrig::Run gap = step();
  for (Channel& c : gap.channels)
    if (c.name == "alpha") c.value[17] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THAT(message_of(problem(model_of("seed/rig.toml", 1), gap)), HasSubstr("alpha has no number at 0.017 s"));

  const unrig::Run pluck = run(meta_data("pluck", "0 m/s") + "time [s],gauge [N]\n0,1\n0.1,2\n0.2,3\n");
  EXPECT_THAT(message_of(problem(model_of("seed/rig.toml", 1), pluck)), HasSubstr("released from"));

  SimulateProblem released = problem(model_of("seed/rig.toml", 1), step());
  released.release_load = 1;
  EXPECT_THAT(message_of(released), HasSubstr("a release load for a step"));

  const unrig::Run forced = run(meta_data("forced", "0 m/s") + "time [s],gauge [N]\n0,1\n0.1,2\n0.2,3\n");
  EXPECT_THAT(message_of(problem(model_of("seed/rig.toml", 1), forced)), HasSubstr("wanted a column \"force\""));
}

TEST_F(Simulate, WarnsOfAMotionThatIsARecording) {
  unrig::Run noisy = step();
  for (Channel& c : noisy.channels)
    if (c.name == "alpha")
      for (Index k = 0; k < c.value.size(); ++k) c.value[k] += 1e-4 * std::sin(1e3 * static_cast<double>(k * k));
  EXPECT_THAT(simulate(problem(model_of("seed/rig.toml", 1), noisy)).warnings, ElementsAre(HasSubstr("carries noise")));
}

}  // namespace
}  // namespace unrig
