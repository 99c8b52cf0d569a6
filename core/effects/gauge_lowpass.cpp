#include <numbers>

#include "core/effects/list.h"
#include "core/rig/gauge_filter.h"

namespace unrig {

namespace {

constexpr const char* near_cutoff = "Record a pluck or step that excites a mode near the cutoff, sampled faster.";

}  // namespace

/// Amplifier or anti-alias filter in the gauge channel, a second-order low-pass: y_f'' + 2 zeta w_c y_f' + w_c^2 y_f = w_c^2 y, w_c = 2 pi f_c, y the moment at the bridge.
/// f_c [Hz] and zeta are shared; zeta = 1/sqrt(2) is Butterworth's, a large zeta makes it first order with its corner at f_c / (2 zeta).
/// Source: S. Butterworth, Wireless Engineer 7 (1930) 536.
Effect gauge_lowpass() {
  Effect e;
  e.id = "gauge-lowpass";
  e.summary = "amplifier or anti-alias filter in the gauge channel";
  e.equation = "y_f'' + 2 zeta w_c y_f' + w_c^2 y_f = w_c^2 y, w_c = 2 pi f_c, gauge = y_f";
  e.kind = "signal";
  e.source = "Butterworth, Wireless Engineer 7 (1930) 536";
  e.parameters = {{"cutoff", "Hz", 30, 0.5, 1e4, false, near_cutoff}, {"damping_ratio", "1", 1 / std::numbers::sqrt2, 0.2, 20, false, near_cutoff, Role::damping}};
  for (double f = 3; f < 400; f *= 1.5) e.starts.push_back(Eigen::Vector2d(f, 1 / std::numbers::sqrt2));
  e.draw = [](const AeroelasticModel&, double, Effect::Random& random) -> Eigen::VectorXd { return log_between(random, {{4, 150}, {0.7, 0.7}}); };
  e.states = [](const AeroelasticModel&, const Conditions&) -> Eigen::Index { return 2; };
  e.acts = [](const Rig&, const Conditions&) { return true; };
  e.apply = [](LinearSystem& system, const EffectContext& c) {
    if (c.gauge < 0) return;
    append_gauge_filter(system, c.gauge, low_pass(c.parameter(0), c.parameter(1), {c.first_parameter, c.theta.size()}));
  };
  return e;
}

}  // namespace unrig
