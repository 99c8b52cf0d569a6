#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "fit/search/modal_start.h"
#include "fit/search/no_worse_than_start.h"
#include "fit/likelihood/readings_noise.h"
#include "fit/uncertainty/unfitted_modes.h"
#include "tests/fit/impact_cases.h"

// Impact tests: a hammer whose force is measured with noise. Before that noise counted, and the starts were those of the spectra, four of ten fits from the truth ended with masses of 200 kg or 4e-6 kg.

namespace unrig {
namespace {

using namespace impact;
using ::testing::HasSubstr;

std::string sample(const std::string& file) { return std::string(UNRIG_SOURCE_DIR) + "/sample_data/impact/" + file; }

const FittedParameter& parameter(const FitResult& result, const std::string& name) {
  return *std::find_if(result.parameters.begin(), result.parameters.end(), [&](const FittedParameter& p) { return p.name == name; });
}

/// Explained to the noise, and everything that is identified within four standard errors of the truth (one in 16 000 is further off by chance).
void expect_truth(const Rig& truth, const FitResult& result, std::size_t identified) {
  EXPECT_EQ(result.no_answer, "");
  EXPECT_NEAR(result.reduced_chi2(), 1, 0.06 + 5 * std::sqrt(2 / static_cast<double>(result.observations)));  // the levels of the noise are known to some per cent
  EXPECT_EQ(static_cast<std::size_t>(standard_scores(truth, result).size()), identified);
  for (const FittedParameter& p : result.parameters) {
    if (p.identified) {
      EXPECT_LT(std::abs(p.value - truth_of(truth, p.name)), 4 * p.std_error) << p.name << " is " << p.value << " +- " << p.std_error;
    }
  }
}

JointProblem joint_of(const AeroelasticModel& model, const std::vector<unrig::Run>& runs) {
  std::vector<RunResidual> residuals;
  for (const unrig::Run& run : runs) residuals.emplace_back(model, run, std::vector<MotionBasis::Window>{});
  return {model, std::move(residuals)};
}

Unknown& unknown(JointProblem& joint, const std::string& name) {
  return *std::find_if(joint.unknowns().begin(), joint.unknowns().end(), [&](const Unknown& u) { return joint.parameter(u).name == name; });
}

/// The file that a user tried: 201 +- 58 kg and exit 0 before.
TEST(ImpactTest, FindsTheBalanceFromItsOwnFile) {
  const Rig truth = read_rig(sample("rig.toml"));
  const std::vector<unrig::Run> runs{read_run(sample("hammer.csv"))};
  for (const char* file : {"rig.toml", "rig_9_percent_off.toml"}) {
    FitProblem problem;
    problem.rig = read_rig(sample(file));
    problem.runs = runs;
    expect_truth(truth, fit(problem), 6);
  }
}

/// Eight draws only: a short form, that notices errors wrong by a factor of two.
TEST(ImpactTest, ErrorsAreAsLargeAsTheySay) {
  const Rig truth = balance();
  double squares = 0, count = 0, chi2 = 0;
  constexpr unsigned draws = 8;
  for (unsigned seed = 1; seed <= draws; ++seed) {
    Impact hit;
    hit.seed = seed;
    FitProblem problem;
    problem.rig = truth;
    problem.runs = {record(truth, hit)};
    const FitResult result = fit(problem);
    const VectorXd scores = standard_scores(truth, result);
    EXPECT_EQ(scores.size(), 6) << seed;
    squares += scores.squaredNorm();
    count += static_cast<double>(scores.size());
    chi2 += result.reduced_chi2() / draws;
  }
  EXPECT_NEAR(squares / count, 1, 4 * std::sqrt(2 / count));
  EXPECT_NEAR(chi2, 1, 0.05);
}

/// Three modes whose frequencies and dampings are off by up to a fifth and a half, four of which two are close, and ten times the noise of the force.
TEST(ImpactTest, FindsModesFromStartsThatAreOff) {
  Rig three, four;
  three.modal = {mode(2.1, 18.3, 0.006, 27800), mode(1.4, 64, 0.01, 50000), mode(0.8, 141, 0.008, 60000)};
  four.modal = {mode(2.1, 18.3, 0.006, 27800), mode(1.4, 31, 0.01, 50000), mode(1.9, 34, 0.012, 40000), mode(0.8, 141, 0.008, 60000)};
  for (const Rig& truth : {three, four}) {
    Impact hit;
    hit.seed = 7;
    hit.length = 3;
    FitProblem problem;
    problem.rig = truth;
    const double off[] = {1.15, 0.88, 0.92, 1.1}, wider[] = {1.5, 0.6, 1.4, 0.7};
    for (std::size_t i = 0; i < truth.modal.size(); ++i) problem.rig.modal[i].frequency *= off[i], problem.rig.modal[i].damping_ratio *= wider[i], problem.rig.modal[i].mass *= off[3 - i];
    problem.runs = {record(truth, hit)};
    expect_truth(truth, fit(problem), 3 * truth.modal.size());
  }
}

/// What the measured force drives has noise in it too: with weights that do not follow the parameters the masses come out a tenth too large, ten of their standard errors.
TEST(ImpactTest, FindsTheBalanceUnderTenTimesTheNoise) {
  Impact hit;
  hit.force_noise = 3;
  hit.seed = 11;
  FitProblem problem;
  problem.rig = balance();
  problem.runs = {record(balance(), hit)};
  expect_truth(balance(), fit(problem), 6);
}

/// The filter that makes the noise white moves with the model: its share in the slopes, by differences of chi-square far from the least.
void expect_slopes_of_chi2(const AeroelasticModel& model, VectorXd theta) {
  Impact hit;
  hit.force_noise = 3;
  const unrig::Run run = record(balance(), hit);
  RunResidual residual(model, run, {});
  residual.search_linear_to(1e-6);  // what is left of that search is seen in differences
  residual.settle_noise(theta);
  ASSERT_GT(sigma_of_inputs(residual, theta, 0), 0);
  for (Index j = 0; j < 6; ++j) theta[j] *= j % 3 == 1 ? 1.002 : 1.1;
  const RunResidual::Evaluation e = residual.evaluate(theta, Partials::all);
  const VectorXd slope = 2 * e.jacobian.transpose() * e.residual;
  for (Index j = 0; j < theta.size(); ++j) {
    if (theta[j] == 0 || model.parameters()[static_cast<std::size_t>(j)].name.ends_with("mount_participation")) continue;
    VectorXd more = theta, less = theta;
    const double step = 1e-4 * theta[j];
    more[j] += step, less[j] -= step;
    const double difference = (residual.evaluate(more, Partials::none).chi2 - residual.evaluate(less, Partials::none).chi2) / (2 * step);
    EXPECT_NEAR(slope[j], difference, 1e-5 * std::abs(difference)) << model.parameters()[static_cast<std::size_t>(j)].name;
  }
}

TEST(ImpactTest, SlopesHoldWhatTheParametersDoToTheNoise) {
  const AeroelasticModel model(balance(), {}, {});
  expect_slopes_of_chi2(model, model.start_values());
}

/// What a law drives is no measured input: an error of the inputs reaches the rig through the columns of these alone.
TEST(ImpactTest, AndUnderALaw) {
  const AeroelasticModel model = AeroelasticModel(balance(), {}, {}).with_effects({"cubic-stiffness"});
  VectorXd theta = model.start_values();
  theta[model.index("cubic-stiffness.coefficient")] = 1e7;
  expect_slopes_of_chi2(model, theta);
}

/// An accelerometer beside the gauge and instead of it.
TEST(ImpactTest, AnAccelerometerStandsBesideOrInPlaceOfTheGauge) {
  for (const bool beside : {true, false}) {
    Rig truth = balance();
    Sensor sensor;
    sensor.column = "acc";
    sensor.reads = SensorKind::acceleration;
    sensor.unit = "m/s^2";
    truth.sensors = {sensor};
    truth.modal[0].sensor_shape = {1.0};
    truth.modal[1].sensor_shape = {-0.4};
    if (!beside)
      for (ModalMode& m : truth.modal) m.gauge_gain = 0;
    Impact hit;
    hit.seed = 21;
    hit.sensor_noise = 0.2;
    FitProblem problem;
    problem.rig = truth;
    problem.rig.modal[0].frequency *= 1.1;
    problem.rig.modal[1].mass *= 1.3;
    problem.runs = {record(truth, hit)};
    const FitResult result = fit(problem);
    ASSERT_EQ(result.runs.front().channels.size(), beside ? 2u : 1u);
    expect_truth(truth, result, 6);
  }
}

TEST(ImpactTest, AModeAboveTheNyquistFrequencyIsHeld) {
  Rig rig = balance();
  rig.modal.push_back(mode(0.5, 400, 0.01, 30000));
  FitProblem problem;
  problem.rig = rig;
  problem.runs = {record(balance(), {})};
  const FitResult result = fit(problem);
  EXPECT_EQ(result.no_answer, "");
  for (const char* name : {"modal[3].mass", "modal[3].stiffness", "modal[3].damping"}) {
    const FittedParameter& p = parameter(result, name);
    EXPECT_FALSE(p.identified);
    EXPECT_EQ(p.value, p.start) << name;
    EXPECT_THAT(p.advice, HasSubstr("half the sampling rate"));
  }
}

/// A search does not take a mode there either.
TEST(ImpactTest, NoModeIsTakenAboveTheNyquistFrequency) {
  const AeroelasticModel model(balance(), {}, {});
  const std::vector<unrig::Run> runs{record(balance(), {})};
  JointProblem joint = joint_of(model, runs);
  const LeastSquaresProblem squares = joint.least_squares();
  VectorXd values = squares.values();
  EXPECT_TRUE(linearise(squares, values).finite);
  values[1] = values[0] * std::pow(2 * pi * 251, 2);  // stiffness of the first mode
  EXPECT_FALSE(linearise(squares, values).finite);
}

TEST(ImpactTest, AModeThatTheFitDoesNotFollowIsNamed) {
  const AeroelasticModel model(balance(), {}, {});
  const std::vector<unrig::Run> runs{record(balance(), {})};
  JointProblem joint = joint_of(model, runs);
  EXPECT_TRUE(unfitted_modes(joint).empty());
  unknown(joint, "modal[2].mass").value *= 1e4;
  unknown(joint, "modal[2].stiffness").value *= 1e4;
  const std::vector<UnfittedMode> found = unfitted_modes(joint);
  ASSERT_EQ(found.size(), 1u);
  EXPECT_EQ(found.front().mode, 1u);
  EXPECT_NEAR(found.front().frequency, 64, 0.4);
  FitResult result;
  refuse_unfitted_modes(joint, result);
  EXPECT_THAT(result.no_answer, HasSubstr("modal[2]"));
}

TEST(ImpactTest, ReturnsToTheStartWhereThatIsBetter) {
  FitProblem problem;
  problem.rig = balance();
  problem.runs = {record(balance(), {})};
  const auto model = std::make_shared<const AeroelasticModel>(problem.rig, Basis{}, IndicialFunction{});
  Arrival arrival{model, {{}}, joint_of(*model, problem.runs)};
  EXPECT_EQ(no_worse_than_start(arrival, problem), "") << "it stands at the start";
  unknown(arrival.joint, "modal[1].mass").value = 201;
  const double lost = arrival.joint.chi2();
  EXPECT_THAT(no_worse_than_start(arrival, problem), HasSubstr("start values"));
  EXPECT_LT(arrival.joint.chi2(), 0.1 * lost);
}

TEST(ImpactTest, ResonancesAreThoseOfTheFrequencyResponse) {
  const AeroelasticModel model(balance(), {}, {});
  const std::vector<unrig::Run> runs{record(balance(), {})};
  const JointProblem joint = joint_of(model, runs);
  std::vector<double> lines = resonances(joint.runs().front());
  ASSERT_GE(lines.size(), 2u);
  lines.resize(2);
  std::sort(lines.begin(), lines.end());
  EXPECT_NEAR(lines[0], 18.3, 0.2);  // a line of the padded spectrum is 1/6 Hz
  EXPECT_NEAR(lines[1], 64, 0.2);
}

}  // namespace
}  // namespace unrig
