#pragma once
#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <utility>

#include "core/model/simulate.h"
#include "tests/correct/null_campaign.h"

namespace unrig::test {

constexpr double recorded_dt = 0.002, recorded_slope = 5.86;

struct Recorded {
  Run run;
  Eigen::VectorXd circulatory, normal_force;
};

/// A run of the null campaign's rig with the noise of its channels, of this angle [deg] over time [s] beside 2 degrees: simulated at a quarter of the sampling interval, with Wagner's function.
inline Recorded record(double (*angle)(double), Eigen::Index samples, unsigned seed = 11, const FittedRig& fit = null_fit()) {
  constexpr double gauge_noise = 0.027, angle_noise = 0.01 * std::numbers::pi / 180;
  constexpr Eigen::Index finer = 4;
  const AeroelasticModel model = AeroelasticModel(null_rig(), make_basis(null_rig(), fit.normal_modes, fit.torsion_modes), wagner(Wagner::within_1e6)).with_effects(fit.effects);
  Run motion;
  motion.file = "recorded.csv";
  motion.density = 998.2;
  motion.speed = 0.6096;
  motion.dt = recorded_dt / finer;
  Eigen::VectorXd fine(finer * samples);
  for (Eigen::Index k = 0; k < fine.size(); ++k) fine[k] = (2 + angle(motion.time(k))) * std::numbers::pi / 180;
  motion.channels.push_back({"alpha", "rad", "rad", 1, fine, 0});
  Eigen::VectorXd theta = theta_for(model, fit, "");
  theta[model.index("normal_force_slope")] = recorded_slope;
  const SimulateResult truth = simulate({model, theta, motion, PitchBetweenSamples::spline, std::nullopt, 0.2});
  const auto sampled = [&](const std::string& channel) -> Eigen::VectorXd {
    return truth.run.channel(channel).value(Eigen::VectorXi::LinSpaced(samples, 0, static_cast<int>(finer * (samples - 1))));
  };
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  const auto noisy = [&](Eigen::VectorXd x, double sigma) {
    for (double& value : x) value += sigma * normal(random);
    return x;
  };
  Recorded r{motion, sampled("circulatory"), sampled("normal_force")};
  r.run.dt = recorded_dt;
  r.run.channels = {{"alpha", "rad", "rad", 1, noisy(sampled("alpha"), angle_noise), 0}, {"gauge", "N", "N", 1, noisy(sampled("gauge"), gauge_noise), 0}};
  return r;
}

/// A channel to change.
inline Eigen::VectorXd& channel_of(Run& run, const std::string& name) {
  return std::find_if(run.channels.begin(), run.channels.end(), [&](const Channel& c) { return c.name == name; })->value;
}

inline double rms(const Eigen::VectorXd& x) { return x.norm() / std::sqrt(static_cast<double>(x.size())); }

/// The null campaign's rig with a build-up of circulation that is free.
inline AeroelasticModel free_circulation() {
  const Eigen::VectorXd rates{{0.003, 0.03, 0.1, 0.3, 1.2}};
  return {null_rig(), make_basis(null_rig(), null_fit().normal_modes, null_fit().torsion_modes), {"free", Eigen::VectorXd{{0.02, 0.1, 0.15, 0.2, 0.03}}, rates}, AeroelasticModel::Circulation::free};
}

/// The null campaign's fit as if it had found dry friction too: force [N] and velocity [m/s].
inline FittedRig with_friction(double force = 0.1, double velocity = 0.1) {
  FittedRig fit = null_fit();
  fit.effects = {"coulomb-friction"};
  for (const auto& [name, value] : {std::pair{"coulomb-friction.force", force}, {"coulomb-friction.velocity", velocity}}) {
    fit.parameters.emplace_back();
    fit.parameters.back().name = name;
    fit.parameters.back().value = value;
  }
  fit.correlation = Eigen::MatrixXd::Identity(static_cast<Eigen::Index>(fit.parameters.size()), static_cast<Eigen::Index>(fit.parameters.size()));
  return fit;
}

/// 0 to 1 for x from 0 to 1.
inline double soft(double x) { return x <= 0 ? 0 : x >= 1 ? 1 : x * x * x * (10 - 15 * x + 6 * x * x); }

}  // namespace unrig::test
