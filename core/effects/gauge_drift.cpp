#include "core/effects/list.h"

namespace unrig {

/// Slow zero drift of the gauge: d(t) = c exp(-t/tau), which with the run's constant offset is a bridge warming up, and for tau much longer than the
/// record a straight line. tau [s] is shared; c belongs to each run.
/// Source: first-order thermal settling of a bonded strain gauge (A. L. Window, Strain Gauge Technology, 1992).
Effect gauge_drift() {
  Effect e;
  e.id = "gauge-drift";
  e.summary = "slow zero drift of the gauge";
  e.equation = "gauge += c exp(-t/tau)";
  e.kind = "signal";
  e.source = "Window, Strain Gauge Technology (1992)";
  e.parameters = {{"time", "s", 20, 2, 1e3, false, "Record a longer run."}};
  for (const double tau : {3.0, 10.0, 40.0, 200.0}) e.starts.push_back(Eigen::VectorXd::Constant(1, tau));
  e.draw = [](const AeroelasticModel&, double, Effect::Random& random) { return log_between(random, {{3, 40}}); };
  e.states = [](const AeroelasticModel&, const Conditions&) -> Eigen::Index { return 1; };
  e.acts = [](const Rig&, const Conditions&) { return true; };
  e.apply = [](LinearSystem& system, const EffectContext& c) {
    if (c.gauge < 0) return;
    const double tau = c.parameter(0);
    DualMatrix F(Eigen::MatrixXd::Constant(1, 1, -1 / tau), c.theta.size());
    F.add_partial(c.first_parameter, Eigen::MatrixXd::Constant(1, 1, 1 / (tau * tau)));
    append_reading(system, F, c.gauge, DualMatrix(Eigen::MatrixXd::Ones(1, 1), c.theta.size()));
  };
  return e;
}

}  // namespace unrig
