#include <algorithm>
#include <numbers>

#include "core/effects/list.h"

namespace unrig {

/// Mains pick-up in the gauge channel: sum over the first three harmonics of f of a_k cos + b_k sin, steady through each run. f [Hz] is near 50 or 60
/// and shared by all runs; amplitudes belong to each run. Harmonics above half the sampling rate are left out: folded, they would pass for any slow line.
/// Source: any recording near a transformer; power frequency 50 or 60 Hz within 0.5 Hz (EN 50160).
Effect mains_hum() {
  Effect e;
  e.id = "mains-hum";
  e.summary = "50/60 Hz pick-up and harmonics in the gauge channel";
  e.equation = "gauge += sum_k a_k cos 2 pi k f t + b_k sin 2 pi k f t, k = 1..3";
  e.source = "EN 50160 (power frequency)";
  e.parameters = {{"frequency", "Hz", 50, 45, 65, false}};
  for (const double mains : {50.0, 60.0})
    for (const double off : {-0.2, -0.1, 0.0, 0.1, 0.2}) e.starts.push_back(Eigen::VectorXd::Constant(1, mains + off));
  e.acts = [](const Conditions& c) { return c.nyquist == 0 || c.nyquist > 65; };
  e.apply = [](LinearSystem& system, const EffectContext& c) {
    if (c.gauge < 0) return;
    const double nyquist = c.conditions.nyquist;
    const Eigen::Index harmonics = nyquist > 0 ? std::clamp<Eigen::Index>(static_cast<Eigen::Index>(nyquist / c.parameter(0)), 1, 3) : 3;
    const double omega = 2 * std::numbers::pi;
    Eigen::MatrixXd turn = Eigen::MatrixXd::Zero(2 * harmonics, 2 * harmonics);
    Eigen::RowVectorXd read = Eigen::RowVectorXd::Zero(2 * harmonics);
    for (Eigen::Index k = 0; k < harmonics; ++k) {
      turn(2 * k, 2 * k + 1) = omega * static_cast<double>(k + 1);
      turn(2 * k + 1, 2 * k) = -turn(2 * k, 2 * k + 1);
      read[2 * k] = 1;
    }
    DualMatrix F(c.parameter(0) * turn, c.theta.size());
    F.add_partial(c.first_parameter, turn);
    append_reading(system, F, c.gauge, DualMatrix(read, c.theta.size()));
  };
  return e;
}

}  // namespace unrig
