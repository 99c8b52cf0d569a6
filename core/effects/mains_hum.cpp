#include <algorithm>
#include <array>
#include <numbers>

#include "core/effects/list.h"

namespace unrig {

namespace {

/// Mains are 50 or 60 Hz within one per cent [Hz].
constexpr std::array<Effect::Band, 2> mains{{{49.5, 50.5}, {59.4, 60.6}}};
constexpr Eigen::Index most_harmonics = 3;

/// Harmonics of a frequency up to `highest` that lie below the Nyquist frequency (0: not known), whatever it is exactly.
Eigen::Index harmonics_below(double nyquist, double highest) {
  return nyquist > 0 ? std::clamp<Eigen::Index>(static_cast<Eigen::Index>(nyquist / highest), 0, most_harmonics) : most_harmonics;
}

/// Those of 50 Hz: there are no more of 60.
Eigen::Index harmonics_of(const Conditions& c) { return harmonics_below(c.nyquist, mains[0].second); }

}  // namespace

/// Mains pick-up in the gauge channel: sum over the first three harmonics of f of a_k cos + b_k sin, steady through each run. f [Hz] is 50 or 60 within one per cent
/// and shared by all runs; amplitudes belong to each run. Harmonics that may lie above half the sampling rate are left out: folded, they would pass for any slow line.
/// The states are those of 50 Hz; what would be too fast of 60 Hz is not read.
/// Source: EN 50160, power frequency of synchronously connected grids: 50 Hz within 1 % for 99.5 % of the year; the same share of 60 Hz.
Effect mains_hum() {
  Effect e;
  e.id = "mains-hum";
  e.summary = "50/60 Hz pick-up and harmonics in the gauge channel";
  e.equation = "gauge += sum_k a_k cos 2 pi k f t + b_k sin 2 pi k f t, k = 1..3";
  e.kind = "signal";
  e.source = "EN 50160 (power frequency)";
  e.parameters = {{"frequency", "Hz", 50, mains[0].first, mains[1].second, false, "Record a longer run."}};
  e.bands = {mains[0], mains[1]};
  e.frequency = [](const AeroelasticModel&, const Conditions&, const Eigen::VectorXd& p) { return p[0]; };
  e.draw = [](const AeroelasticModel&, double, Effect::Random& random) { return log_between(random, {{49.8, 50.2}}); };
  e.acts_in = "a run sampled at more than 101 Hz";
  e.acts = [](const Rig&, const Conditions& c) { return harmonics_of(c) > 0; };
  e.states = [](const AeroelasticModel&, const Conditions& c) -> Eigen::Index { return 2 * harmonics_of(c); };
  e.apply = [](LinearSystem& system, const EffectContext& c) {
    if (c.gauge < 0) return;
    const bool slower = c.parameter(0) < 0.5 * (mains[0].second + mains[1].first);
    const Eigen::Index harmonics = harmonics_of(c.conditions), read_of = harmonics_below(c.conditions.nyquist, mains[slower ? 0 : 1].second);
    const double omega = 2 * std::numbers::pi;
    Eigen::MatrixXd turn = Eigen::MatrixXd::Zero(2 * harmonics, 2 * harmonics);
    Eigen::RowVectorXd read = Eigen::RowVectorXd::Zero(2 * harmonics);
    for (Eigen::Index k = 0; k < harmonics; ++k) {
      turn(2 * k, 2 * k + 1) = omega * static_cast<double>(k + 1);
      turn(2 * k + 1, 2 * k) = -turn(2 * k, 2 * k + 1);
      read[2 * k] = k < read_of ? 1 : 0;
    }
    DualMatrix F(c.parameter(0) * turn, c.theta.size());
    F.add_partial(c.first_parameter, turn);
    const Eigen::Index first = append_reading(system, F, c.gauge, DualMatrix(read, c.theta.size()));
    for (Eigen::Index k = 0; k < harmonics; ++k) system.parts.push_back({first + 2 * k, first + 2 * k + 1});
  };
  return e;
}

}  // namespace unrig
