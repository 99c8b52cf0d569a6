#pragma once
#include <cmath>
#include <numbers>
#include <random>
#include <string>

#include "core/model/aeroelastic_model.h"

// A rig that is known as one mode, and free decays of it that no part of the program has made.

namespace unrig::one_mode {

using Eigen::Index;
using Eigen::VectorXd;

inline constexpr double hertz = 7, damping_ratio = 0.01, dt = 0.004;

inline Rig rig() {
  Rig rig;
  rig.name = rig.file = "one_mode.toml";
  rig.modal = {{1, hertz, damping_ratio, 1, "N"}};
  return rig;
}

inline AeroelasticModel model() { return {rig(), {}, {}}; }

inline VectorXd white_noise(Index samples, unsigned seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  return VectorXd::NullaryExpr(samples, [&] { return normal(random); });
}

inline VectorXd tone(Index samples, double frequency) {
  return VectorXd::NullaryExpr(samples, [&](Index k) { return std::sin(2 * std::numbers::pi * frequency * dt * static_cast<double>(k)); });
}

/// exp(-zeta omega t) of cosine and sine, in closed form: what the linear rig can do from any start.
inline Eigen::MatrixX2d free_response(Index samples, double frequency, double zeta = damping_ratio) {
  const double omega = 2 * std::numbers::pi * frequency, damped = omega * std::sqrt(1 - zeta * zeta);
  Eigen::MatrixX2d y(samples, 2);
  for (Index k = 0; k < samples; ++k) {
    const double t = dt * static_cast<double>(k);
    y.row(k) << std::exp(-zeta * omega * t) * std::cos(damped * t), std::exp(-zeta * omega * t) * std::sin(damped * t);
  }
  return y;
}

/// A free decay in air that reads this [N].
inline Run decay(const std::string& file, const VectorXd& reading) {
  Run run;
  run.file = file;
  run.kind = RunKind::pluck;
  run.medium = "air";
  run.density = 1.2;
  run.dt = dt;
  run.channels.push_back({"gauge", "N", "N", 1, reading});
  return run;
}

}  // namespace unrig::one_mode
