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

/// White noise taken at so many times the rate and decimated behind a filter of a windowed sinc, as converters do: its spectrum is flat, and half of that at half the sampling rate.
inline VectorXd decimated_noise(Index samples, unsigned seed) {
  constexpr Index times = 4, taps = 41;
  VectorXd filter(taps);
  for (Index j = 0; j < taps; ++j) {
    const double at = std::numbers::pi * (static_cast<double>(j) - 0.5 * (taps - 1)) / times, window = 0.54 - 0.46 * std::cos(2 * std::numbers::pi * static_cast<double>(j) / (taps - 1));
    filter[j] = window * (at == 0 ? 1 : std::sin(at) / at);
  }
  filter /= filter.norm();
  const VectorXd white = white_noise(times * samples + taps, seed);
  return VectorXd::NullaryExpr(samples, [&](Index k) { return white.segment(times * k, taps).dot(filter); });
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

/// q'' + 2 zeta omega q' + omega^2 q + beside(q, q') = 0 from rest at `start` on, by Runge and Kutta's rule in so many steps a sample.
template <typename Force>
VectorXd decay_beside(const Force& beside, double start, Index samples, int steps) {
  const double omega = 2 * std::numbers::pi * hertz, h = dt / steps;
  const auto slope = [&](const Eigen::Vector2d& x) { return Eigen::Vector2d(x[1], -2 * damping_ratio * omega * x[1] - omega * omega * x[0] - beside(x[0], x[1])); };
  Eigen::Vector2d x(start, 0);
  VectorXd q(samples);
  for (Index k = 0; k < samples; ++k) {
    q[k] = x[0];
    for (int i = 0; i < steps; ++i) {
      const Eigen::Vector2d a = slope(x), b = slope(x + h / 2 * a), c = slope(x + h / 2 * b), d = slope(x + h * c);
      x += h / 6 * (a + 2 * b + 2 * c + d);
    }
  }
  return q;
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
