#include "core/effects/list.h"

namespace unrig {

/// The gauge channel is late against the angle channel by tau [s]: y_d(t) = y(t - tau), as the all-pass of order three that agrees with exp(-tau p) to the order tau^7 (Pade);
/// its phase is off by 1e-3 rad where 2 pi f tau = 1.6. A gauge that is early shows as tau at its bound 0.
/// Source: G. A. Baker and P. Graves-Morris, Pade Approximants (1996), section 1.2.
Effect channel_delay() {
  Effect e;
  e.id = "channel-delay";
  e.summary = "gauge channel late against the angle channel";
  e.equation = "gauge(t) = y(t - tau)";
  e.source = "Baker and Graves-Morris, Pade Approximants (1996), section 1.2";
  e.parameters = {{"time", "s", 0.004, 1e-4, 0.2, false}};
  for (const double tau : {0.003, 0.008, 0.02, 0.05}) e.starts.push_back(Eigen::VectorXd::Constant(1, tau));
  e.acts = [](const Conditions& c) { return c.speed > 0; };
  e.on_modal_rigs = false;
  e.apply = [](LinearSystem& system, const EffectContext& c) {
    if (c.gauge < 0) return;
    // Time in units of tau: P(-x)/P(x), P(x) = 1 + x/2 + x^2/10 + x^3/120, in controllable form; everything scales with 1/tau.
    const double tau = c.parameter(0);
    const Eigen::Matrix3d F = (Eigen::Matrix3d() << 0, 1, 0, 0, 0, 1, -120, -60, -12).finished();
    const Eigen::Vector3d g(0, 0, 1);
    const Eigen::RowVector3d h(240, 0, 24);  // (P(-x) + P(x)) / (P(x)/120): the all-pass is this less one
    const auto over_tau = [&](const Eigen::MatrixXd& m) {
      DualMatrix scaled(m / tau, c.theta.size());
      scaled.add_partial(c.first_parameter, -m / (tau * tau));
      return scaled;
    };
    append_gauge_filter(system, c, over_tau(F), over_tau(g), h, -1);
  };
  return e;
}

}  // namespace unrig
