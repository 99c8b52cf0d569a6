#pragma once
#include <Eigen/Core>
#include <cmath>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include "fit/fit.h"

// Impact tests of structures that are known as modes, integrated mode by mode without any of the model's code: a hammer's measured force and the readings have noise.

namespace unrig::impact {

using Eigen::Index;
using Eigen::VectorXd;
using std::numbers::pi;

struct Impact {
  Index samples = 1500;
  double dt = 0.002;
  double peak = 200, force_noise = 0.3, gauge_noise = 0.05, sensor_noise = 0;
  Index onset = 100, length = 6;  ///< samples
  unsigned seed = 1;
};

/// A half sine, straight between the samples.
inline VectorXd blow(const Impact& impact) {
  VectorXd force = VectorXd::Zero(impact.samples);
  for (Index k = 0; k <= impact.length; ++k) force[impact.onset + k] = impact.peak * std::sin(pi * static_cast<double>(k) / static_cast<double>(impact.length));
  return force;
}

struct Movement {
  VectorXd q, rate, acceleration;
};

/// m q'' + c q' + k q = force by Runge and Kutta's fourth-order rule in twenty steps a sample.
inline Movement movement(const ModalMode& mode, const VectorXd& force, double dt) {
  const double omega = 2 * pi * mode.frequency, c = 2 * mode.damping_ratio * omega;
  constexpr int steps = 20;
  const double h = dt / steps;
  Movement m{VectorXd(force.size()), VectorXd(force.size()), VectorXd(force.size())};
  double q = 0, v = 0;
  const auto a = [&](double at_q, double at_v, double f) { return f / mode.mass - c * at_v - omega * omega * at_q; };
  for (Index k = 0; k < force.size(); ++k) {
    m.q[k] = q, m.rate[k] = v, m.acceleration[k] = a(q, v, force[k]);
    const double next = k + 1 < force.size() ? force[k + 1] : force[k];
    for (int i = 0; i < steps; ++i) {
      const auto f = [&](double t) { return force[k] + (next - force[k]) * (i + t) / steps; };
      const double v1 = v, a1 = a(q, v, f(0)), v2 = v + h / 2 * a1, a2 = a(q + h / 2 * v1, v2, f(0.5)), v3 = v + h / 2 * a2, a3 = a(q + h / 2 * v2, v3, f(0.5)), v4 = v + h * a3, a4 = a(q + h * v3, v4, f(1));
      q += h / 6 * (v1 + 2 * v2 + 2 * v3 + v4);
      v += h / 6 * (a1 + 2 * a2 + 2 * a3 + a4);
    }
  }
  return m;
}

/// The recording of a rig whose file is the truth: gauge, and every sensor, as far as the rig has them.
inline unrig::Run record(const Rig& truth, const Impact& impact) {
  const VectorXd force = blow(impact);
  std::mt19937_64 engine(impact.seed);
  const auto noisy = [&](const VectorXd& x, double sigma) -> VectorXd {
    std::normal_distribution<double> normal(0, 1);
    return x + sigma * VectorXd::NullaryExpr(x.size(), [&] { return normal(engine); });
  };
  VectorXd gauge = VectorXd::Zero(force.size());
  std::vector<VectorXd> sensors(truth.sensors.size(), gauge);
  for (const ModalMode& mode : truth.modal) {
    const Movement m = movement(mode, force, impact.dt);
    gauge += mode.gauge_gain * m.q;
    for (std::size_t s = 0; s < sensors.size(); ++s) {
      const SensorKind reads = truth.sensors[s].reads;
      const VectorXd& seen = reads == SensorKind::velocity ? m.rate : reads == SensorKind::acceleration ? m.acceleration : m.q;
      sensors[s] += truth.sensors[s].gain * mode.sensor_shape[s] * seen;
    }
  }
  unrig::Run run;
  run.file = "hammer.csv";
  run.kind = RunKind::forced;
  run.density = 1.2;
  run.dt = impact.dt;
  const auto add = [&](const std::string& name, const std::string& unit, const VectorXd& value) { run.channels.push_back({name, unit, unit, 1, value, 0}); };
  add("force", "N", noisy(force, impact.force_noise));
  if (truth.modal.front().gauge_gain != 0) add("gauge", "N", noisy(gauge, impact.gauge_noise));
  for (std::size_t s = 0; s < sensors.size(); ++s) add(truth.sensors[s].column, truth.sensors[s].unit, noisy(sensors[s], impact.sensor_noise));
  return run;
}

inline ModalMode mode(double mass, double frequency, double damping_ratio, double gain, std::vector<double> shape = {}) {
  ModalMode m;
  m.mass = mass;
  m.frequency = frequency;
  m.damping_ratio = damping_ratio;
  m.gauge_gain = gain;
  m.gauge_unit = "N";
  m.sensor_shape = std::move(shape);
  return m;
}

/// The balance of the trial: 2.1 kg at 18.3 Hz and 1.4 kg at 64 Hz.
inline Rig balance() {
  Rig rig;
  rig.file = "rig.toml";
  rig.modal = {mode(2.1, 18.3, 0.006, 27800), mode(1.4, 64, 0.01, 50000)};
  return rig;
}

/// The truth of a parameter of the model by name.
inline double truth_of(const Rig& rig, const std::string& name) {
  const ModalMode& m = rig.modal[static_cast<std::size_t>(std::stoi(name.substr(6))) - 1];
  const double omega = 2 * pi * m.frequency;
  if (name.ends_with(".mass")) return m.mass;
  if (name.ends_with(".stiffness")) return m.mass * omega * omega;
  return 2 * m.damping_ratio * m.mass * omega;
}

/// Errors of what was identified, in standard errors.
inline VectorXd standard_scores(const Rig& truth, const FitResult& result) {
  std::vector<double> scores;
  for (const FittedParameter& p : result.parameters)
    if (p.identified) scores.push_back((p.value - truth_of(truth, p.name)) / p.std_error);
  return Eigen::Map<const VectorXd>(scores.data(), static_cast<Index>(scores.size()));
}

}  // namespace unrig::impact
