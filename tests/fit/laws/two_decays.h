#pragma once
#include <cmath>
#include <functional>
#include <numbers>

#include "fit/fit.h"
#include "tests/fit/one_mode.h"

// Free decays of a rig of one mode under any force, by an integrator that shares no code with the fit.

namespace unrig::two_decays {

using Eigen::Index;
using Eigen::VectorXd;

using Force = std::function<double(double, double)>;

inline constexpr double noise = 0.002;  // N; the rig's gauge reads its displacement, 1 N per metre, so that decays of 1 begin at 500 times it
inline constexpr double omega = 2 * std::numbers::pi * one_mode::hertz, stiffness = omega * omega;

/// Displacement and velocity, one row per sample, of x'' + 2 zeta omega x' + omega^2 x = force(x, v) from `start`, by the classical Runge-Kutta method in eight steps a sample.
inline Eigen::MatrixX2d states(const Force& force, double start, Index samples) {
  constexpr int finer = 8;
  const double h = one_mode::dt / finer;
  using State = Eigen::Vector2d;
  const auto slope = [&](const State& s) {
    return State(s[1], force(s[0], s[1]) - 2 * one_mode::damping_ratio * omega * s[1] - stiffness * s[0]);
  };
  State s(start, 0);
  Eigen::MatrixX2d all(samples, 2);
  for (Index k = 0; k < samples; ++k) {
    all.row(k) = s.transpose();
    for (int i = 0; i < finer; ++i) {
      const State a = slope(s), b = slope(s + h / 2 * a), c = slope(s + h / 2 * b), d = slope(s + h * c);
      s += h / 6 * (a + 2 * b + 2 * c + d);
    }
  }
  return all;
}

/// Two decays, from 1 and from 0.4, one of them to the other side.
inline FitProblem problem(const Force& force, unsigned seed = 3, double of_noise = noise) {
  constexpr Index samples = 900;
  FitProblem problem;
  problem.rig = one_mode::rig();
  problem.runs.push_back(one_mode::decay("large.csv", states(force, 1, samples).col(0) + of_noise * one_mode::white_noise(samples, seed)));
  problem.runs.push_back(one_mode::decay("small.csv", states(force, -0.4, samples).col(0) + of_noise * one_mode::white_noise(samples, seed + 1)));
  return problem;
}

}  // namespace unrig::two_decays
