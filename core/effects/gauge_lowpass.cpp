#include <cmath>
#include <numbers>

#include "core/effects/list.h"

namespace unrig {

/// Amplifier or anti-alias filter in the gauge channel, a second-order low-pass: y_f'' + 2 zeta w_c y_f' + w_c^2 y_f = w_c^2 y, w_c = 2 pi f_c, y the moment at the bridge.
/// f_c [Hz] and zeta are shared; zeta = 1/sqrt(2) is Butterworth's, a large zeta makes it first order with its corner at f_c / (2 zeta). The filter is at
/// rest where the rig is, and in an unknown state where the run starts anyhow.
/// Source: S. Butterworth, Wireless Engineer 7 (1930) 536.
Effect gauge_lowpass() {
  Effect e;
  e.id = "gauge-lowpass";
  e.summary = "amplifier or anti-alias filter in the gauge channel";
  e.equation = "y_f'' + 2 zeta w_c y_f' + w_c^2 y_f = w_c^2 y, w_c = 2 pi f_c, gauge = y_f";
  e.source = "Butterworth, Wireless Engineer 7 (1930) 536";
  e.parameters = {{"cutoff", "Hz", 30, 0.5, 1e4, false}, {"damping_ratio", "1", 1 / std::numbers::sqrt2, 0.2, 20, false}};
  for (double f = 3; f < 400; f *= 1.5) e.starts.push_back(Eigen::Vector2d(f, 1 / std::numbers::sqrt2));
  e.acts = [](const Conditions&) { return true; };
  e.apply = [](LinearSystem& system, const EffectContext& c) {
    if (c.gauge < 0) return;
    const Eigen::Index parameters = c.theta.size(), p = c.first_parameter;
    const double per_hertz = 2 * std::numbers::pi, w = per_hertz * c.parameter(0), zeta = c.parameter(1);
    DualMatrix filter((Eigen::Matrix2d() << 0, 1, -w * w, -2 * zeta * w).finished(), parameters);
    filter.add_partial(p, (Eigen::Matrix2d() << 0, 0, -2 * w * per_hertz, -2 * zeta * per_hertz).finished());
    filter.add_partial(p + 1, (Eigen::Matrix2d() << 0, 0, 0, -2 * w).finished());
    DualMatrix drive(Eigen::Vector2d(0, w * w), parameters);
    drive.add_partial(p, Eigen::Vector2d(0, 2 * w * per_hertz));
    append_gauge_filter(system, c, filter, drive, Eigen::RowVector2d(1, 0), 0);
  };
  return e;
}

}  // namespace unrig
