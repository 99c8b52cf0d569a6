#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <nlohmann/json.hpp>

#include "core/effects/effect.h"
#include "core/text_file.h"
#include "fit/fit.h"
#include "fit/run_residual.h"

namespace unrig {
namespace {

const std::string campaigns = std::string(UNRIG_SOURCE_DIR) + "/sample_data/campaigns/";

FitProblem campaign(const std::string& name, const std::string& effect_id) {
  FitProblem problem;
  problem.rig = read_rig(campaigns + name + "/rig.toml");
  for (const char* run : {"dry_pluck", "wet_pluck", "step_a", "step_b", "step_c"}) problem.runs.push_back(read_run(campaigns + name + "/" + run + ".csv"));
  problem.effects = {effect_id};
  return problem;
}

/// Every parameter within three of its standard errors of the key, and every run down to the noise (the bounds that the project promises).
void expect_recovered(const std::string& name, const std::string& effect_id, const std::map<std::string, double>& effect_truth) {
  const nlohmann::json key = nlohmann::json::parse(read_text(campaigns + "KEY.json"))[name];
  std::map<std::string, double> truth = {{"normal.stiffness_scale", key["truth"]["kn"]},
                                         {"torsion.stiffness_scale", key["truth"]["kt"]},
                                         {"normal.damping_ratio", key["truth"]["zeta_n"]},
                                         {"torsion.damping_ratio", key["truth"]["zeta_t"]},
                                         {"apparent_mass_coefficient", key["truth"]["Ca"]}};
  truth.insert(effect_truth.begin(), effect_truth.end());
  const FitResult result = fit(campaign(name, effect_id));
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
}

TEST(Effects, TankWaveIsRecovered) {
  const auto wave = nlohmann::json::parse(read_text(campaigns + "KEY.json"))["wave"]["parameters"]["wave"];
  expect_recovered("wave", "tank-wave", {{"tank-wave.frequency", wave["hz"]}, {"tank-wave.decay_time", wave["tau"]}});
}

TEST(Effects, GaugeLowpassIsRecovered) {
  const double cutoff = nlohmann::json::parse(read_text(campaigns + "KEY.json"))["lowpass"]["parameters"]["cutoff_hz"];
  expect_recovered("lowpass", "gauge-lowpass", {{"gauge-lowpass.cutoff", cutoff}});
}

/// The system that every effect makes of the seed's rig in a stream, differentiated by slope: central differences have an error of second order, so that a
/// halved step must leave a quarter of it (or round-off).
TEST(Effects, PartialsAgreeWithSlopes) {
  Rig rig = read_rig(campaigns + "null/rig.toml");
  rig.sensors.push_back({"twist", SensorKind::twist, 14, 1, "rad"});  // some effects are for rigs that read it
  Conditions conditions;
  conditions.density = 998.2;
  conditions.speed = 0.6;
  conditions.prescribed_pitch = true;
  conditions.onset_angle = 0.44;  // stalled, so that every effect acts
  const std::vector<std::string> channels{"gauge"};
  constexpr double round_off = 1e-6;  // entries of 1e6 to 1e-16 of themselves, over steps of 5e-5 and slopes of order one
  for (const Effect& e : effects()) {
    const AeroelasticModel model = AeroelasticModel(rig, make_basis(rig, Eigen::Index{3}, Eigen::Index{1}), wagner(Wagner::jones)).with_effects({e.id});
    Eigen::VectorXd theta = model.start_values();
    const Eigen::Index first = theta.size() - static_cast<Eigen::Index>(e.parameters.size());
    for (double& own : theta.tail(theta.size() - first))  // where an effect is absent half of the product rule would go untested
      if (own == 0 || own == 1) own = std::abs(own - 0.3);
    const LinearSystem at = model.system(conditions, theta, channels);
    for (Eigen::Index j = 0; j < theta.size(); ++j) {
      const auto slope_error = [&](double relative) {
        const double h = relative * std::max(0.1, std::abs(theta[j]));
        Eigen::VectorXd up = theta, down = theta;
        up[j] += h;
        down[j] -= h;
        const LinearSystem a = model.system(conditions, up, channels), b = model.system(conditions, down, channels);
        const auto error = [&](const DualMatrix& upper, const DualMatrix& lower, const DualMatrix& here) {
          const Eigen::MatrixXd difference = (upper.value - lower.value) / (2 * h);
          const Eigen::MatrixXd exact = here.depends_on(j) ? here.d(j) : Eigen::MatrixXd::Zero(difference.rows(), difference.cols());
          return (difference - exact).norm() / std::max(1.0, exact.norm());
        };
        return std::max(error(a.A, b.A, at.A), error(a.C, b.C, at.C));
      };
      const double coarse = slope_error(1e-3), fine = slope_error(5e-4);
      EXPECT_TRUE(fine < 0.3 * coarse || fine < round_off) << e.id << " " << model.parameters()[static_cast<std::size_t>(j)].name << " " << coarse << " " << fine;
    }
  }
}

/// The gradient of chi-square that a free decay gives with a nonlinear force at work, everything linear following, against central differences: exact tangents leave the
/// differences' own error (a thousandth of the parameter squared) and what the search for the linear unknowns leaves (a billionth of chi-square over the step). Drag's law
/// has a kink in its second derivative, freeplay's in its first, friction's is as sharp as its velocity.
TEST(Effects, NonlinearForcesHaveExactGradients) {
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

TEST(Effects, UnknownIdsAreRefused) {
  EXPECT_THROW(effect("tank-waves"), std::invalid_argument);
  for (const Effect& e : effects()) EXPECT_EQ(effect(e.id).id, e.id);
}

}  // namespace
}  // namespace unrig
