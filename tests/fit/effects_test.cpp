#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>

#include "core/files/text_file.h"
#include "fit/fit.h"
#include "fit/likelihood/run_residual.h"
#include "tests/support/shared_data.h"

namespace unrig {
namespace {

const std::string campaigns = std::string(UNRIG_SOURCE_DIR) + "/sample_data/campaigns/";

FitProblem campaign(const std::string& folder, const std::string& name, const std::string& effect_id) {
  FitProblem problem;
  problem.rig = read_rig(folder + name + "/rig.toml");
  for (const char* run : {"dry_pluck", "wet_pluck", "step_a", "step_b", "step_c"}) problem.runs.push_back(read_run(folder + name + "/" + run + ".csv"));
  problem.effects = {effect_id};
  return problem;
}

/// Every parameter within three of its standard errors of the key, and every run down to the noise (the bounds that the project promises).
FitResult expect_recovered(const std::string& name, const std::string& effect_id, const std::map<std::string, double>& effect_truth, const std::string& folder = campaigns) {
  const nlohmann::json key = nlohmann::json::parse(read_text(folder + "KEY.json"))[name];
  std::map<std::string, double> truth = {{"normal.stiffness_scale", key["truth"]["kn"]},
                                         {"torsion.stiffness_scale", key["truth"]["kt"]},
                                         {"normal.damping_ratio", key["truth"]["zeta_n"]},
                                         {"torsion.damping_ratio", key["truth"]["zeta_t"]},
                                         {"apparent_mass_coefficient", key["truth"]["Ca"]}};
  truth.insert(effect_truth.begin(), effect_truth.end());
  const FitResult result = fit(campaign(folder, name, effect_id));
  EXPECT_TRUE(result.converged) << result.message;
  std::size_t seen = 0;
  for (const FittedParameter& p : result.parameters) {
    const auto known = truth.find(p.name);
    if (known == truth.end()) continue;
    ++seen;
    // Slow rigs behind a low-pass hardly show the damping of their torsion: then the fit must say so. Everything else must be there.
    if (!p.identified) {
      EXPECT_EQ(p.name, "torsion.damping_ratio") << p.advice;
      continue;
    }
    EXPECT_LT(std::abs(p.value - known->second), 3 * p.std_error) << p.name << ": " << p.value << " +/- " << p.std_error << ", truth " << known->second;
  }
  EXPECT_EQ(seen, truth.size());
  for (const FittedRun& run : result.runs) EXPECT_LT(run.reduced_chi2(), 1.2) << run.file;
  return result;
}

TEST(FittedEffects, TankWaveIsRecovered) {
  const auto wave = nlohmann::json::parse(read_text(campaigns + "KEY.json"))["wave"]["parameters"]["wave"];
  expect_recovered("wave", "tank-wave", {{"tank-wave.frequency", wave["hz"]}, {"tank-wave.decay_time", wave["tau"]}});
}

TEST(FittedEffects, GaugeLowpassIsRecovered) {
  const double cutoff = nlohmann::json::parse(read_text(campaigns + "KEY.json"))["lowpass"]["parameters"]["cutoff_hz"];
  expect_recovered("lowpass", "gauge-lowpass", {{"gauge-lowpass.cutoff", cutoff}});
}

/// Steps from 2, 4 and 25 degrees lose lift alike.
TEST(FittedEffects, SeparationIsRecoveredFromStepsAtAnyAngle) {
  UNRIG_NEEDS_SHARED("campaigns/open2");
  const std::string folder = test::shared_path("campaigns/open2/");
  const nlohmann::json truth = nlohmann::json::parse(read_text(folder + "KEY.json"))["a4"]["parameters"]["separation"];
  expect_recovered("a4", "separation-lag", {{"separation-lag.loss", truth["loss"]}, {"separation-lag.time", truth["time_semichords"]}}, folder);
}

/// Steps from 2, 4 and 25 degrees on one bent curve.
TEST(FittedEffects, TheBendOfTheLiftCurveIsRecovered) {
  UNRIG_NEEDS_SHARED("campaigns/open2");
  const std::string folder = test::shared_path("campaigns/open2/");
  const nlohmann::json truth = nlohmann::json::parse(read_text(folder + "KEY.json"))["o4"]["parameters"];
  expect_recovered("o4", "lift-curve", {{"lift-curve.bend", truth["cubic_lift"]}}, folder);
}

/// Three steps of a carriage that surges, at two speeds, with what stood before the motion; the simulator scales the loads of the strips one by one.
TEST(FittedEffects, TheSurgeOfTheSpeedIsRecovered) {
  UNRIG_NEEDS_SHARED("campaigns/open2");
  const std::string folder = test::shared_path("campaigns/open2/");
  const nlohmann::json key = nlohmann::json::parse(read_text(folder + "KEY.json"))["o8"];
  std::map<std::string, double> truth{{"speed-surge.frequency", key["parameters"]["surge_hz"]}};
  const FitResult result = expect_recovered("o8", "speed-surge", truth, folder);
  for (const std::string step : {"step_a", "step_b", "step_c"}) {
    const auto steady = std::find_if(result.parameters.begin(), result.parameters.end(),
                                     [&](const FittedParameter& p) { return p.name == "speed-surge.steady_normal_force" && p.run.find(step) != std::string::npos; });
    ASSERT_NE(steady, result.parameters.end()) << step;
    EXPECT_LT(std::abs(steady->value - key["runs"][step]["cn0"].get<double>()), 3 * steady->std_error) << step;
    EXPECT_LT(steady->std_error, 0.02 * steady->value) << step;
  }
}

/// A decay in water and three steps while the rig fills. The key tells the mass as a share of that which moves in the first mode.
TEST(FittedEffects, TheMassThatComesInIsRecovered) {
  UNRIG_NEEDS_SHARED("campaigns/open2");
  const std::string folder = test::shared_path("campaigns/open2/");
  const nlohmann::json truth = nlohmann::json::parse(read_text(folder + "KEY.json"))["o9"]["parameters"];
  const Rig rig = read_rig(folder + "o9/rig.toml");
  const Basis basis = make_basis(rig, Eigen::Index{5}, Eigen::Index{1});
  const double shape = basis.normal(rig.loaded_element() - 1, 0), moving = 1 / (shape * shape);  // modes of unit generalised mass
  expect_recovered("o9", "filling-mass", {{"filling-mass.mass", truth["mass_gain_share"].get<double>() * moving}, {"filling-mass.time", truth["fill_tau_s"]}}, folder);
}

/// Finite span in mains hum: the build-up of circulation is the one with which the campaign was made, within its errors, which are small beside what it is off Wagner's.
TEST(FittedEffects, TheBuildUpOfCirculationIsRecovered) {
  UNRIG_NEEDS_SHARED("campaigns/open2");
  const std::string folder = test::shared_path("campaigns/open2/");
  const nlohmann::json truth = nlohmann::json::parse(read_text(folder + "KEY.json"))["a6"]["parameters"]["poles"];
  FitProblem problem = campaign(folder, "a6", "mains-hum");
  problem.effects.push_back("wagner-lag");
  const FitResult result = fit(problem);
  EXPECT_TRUE(result.converged) << result.message;
  for (const FittedRun& run : result.runs) EXPECT_LT(run.reduced_chi2(), 1.2) << run.file;

  const auto place = [&](const std::string& name) {
    const auto found = std::find_if(result.parameters.begin(), result.parameters.end(), [&](const FittedParameter& p) { return p.name == "wagner-lag." + name; });
    return static_cast<Eigen::Index>(found - result.parameters.begin());
  };
  const Eigen::Index at[] = {place("replaced_share"), place("amplitude_1"), place("rate_1"), place("amplitude_2"), place("rate_2")};
  const auto value = [&](int k) { return result.parameters[static_cast<std::size_t>(at[k])].value; };
  const IndicialFunction own = wagner(problem.circulation);
  for (const double s : {0.5, 1.0, 2.0, 4.0, 8.0}) {
    double expected = 1;
    for (const auto& pole : truth) expected -= pole[0].get<double>() * std::exp(-pole[1].get<double>() * s);
    const double first = std::exp(-value(2) * s), second = std::exp(-value(4) * s), missing = 1 - own(s);
    const double phi = 1 - (1 - value(0)) * missing - value(1) * first - value(3) * second;
    const double slope[] = {missing, -first, value(1) * s * first, -second, value(3) * s * second};
    double variance = 0;
    for (int i = 0; i < 5; ++i)
      for (int k = 0; k < 5; ++k)
        variance += slope[i] * slope[k] * result.correlation(at[i], at[k]) * result.parameters[static_cast<std::size_t>(at[i])].std_error * result.parameters[static_cast<std::size_t>(at[k])].std_error;
    const double error = std::sqrt(variance);
    EXPECT_LT(std::abs(phi - expected), 3 * error) << s << " semichords: " << phi << ", truth " << expected;
    EXPECT_LT(error, 0.1 * std::abs(expected - own(s))) << s << " semichords: small beside what is off Wagner's";
  }
}

/// The gradient of chi-square that a free decay gives with a nonlinear force at work, everything linear following, against central differences: exact tangents leave the
/// differences' own error (a thousandth of the parameter squared) and what the search for the linear unknowns leaves (a billionth of chi-square over the step). Drag's law
/// has a kink in its second derivative, freeplay's in its first, friction's is as sharp as its velocity.
TEST(FittedEffects, NonlinearForcesHaveExactGradients) {
  const Rig rig = read_rig(campaigns + "null/rig.toml");
  const unrig::Run run = read_run(campaigns + "null/wet_pluck.csv");
  const std::map<std::string, std::vector<double>> at_work{{"quadratic-drag", {2}}, {"cubic-stiffness", {1e5, 0}}, {"coulomb-friction", {0.05, 0.02}}};
  for (const auto& [id, values] : at_work) {
    const AeroelasticModel model = AeroelasticModel(rig, make_basis(rig, Eigen::Index{3}, Eigen::Index{1}), wagner(Wagner::jones)).with_effects({id});
    Eigen::VectorXd theta = model.start_values();
    theta[model.index("normal.stiffness_scale")] = 0.79;
    for (std::size_t k = 0; k < values.size(); ++k) theta[theta.size() - static_cast<Eigen::Index>(values.size() - k)] = values[k];
    const RunResidual residual(model, run, {}, RunOptions{600});
    const RunResidual::Evaluation e = residual.evaluate(theta, Partials::all);
    const Eigen::VectorXd gradient = 2 * e.jacobian.transpose() * e.residual;
    for (const std::string& name : {std::string("normal.stiffness_scale"), std::string("normal.damping_ratio"), model.parameters().back().name == "coulomb-friction.velocity" ? std::string("coulomb-friction.force") : id + ".coefficient"}) {
      const Eigen::Index j = model.index(name);
      const double h = 1e-3 * theta[j];
      Eigen::VectorXd up = theta, down = theta;
      up[j] += h;
      down[j] -= h;
      const double slope = (residual.evaluate(up, Partials::none).chi2 - residual.evaluate(down, Partials::none).chi2) / (2 * h);
      EXPECT_NEAR(slope, gradient[j], 2e-3 * std::abs(gradient[j])) << id << " " << name;
    }
  }
}

}  // namespace
}  // namespace unrig
