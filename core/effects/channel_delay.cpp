#include "core/effects/list.h"
#include "core/rig/gauge_filter.h"

namespace unrig {

namespace {

constexpr int order = 6;  // of each all-pass

/// All-passes in a row. A rig that vibrates freely hides what a delay does to its phase; there only what the channel showed before the first sample has to be told.
int stages_in(const Conditions& c) { return c.speed > 0 ? 2 : 1; }

/// One of the stages, which all are late by an equal part of `time`.
GaugeFilter stage(double time, int stages, FilterParameters parameters) {
  GaugeFilter part = delay(time / stages, order, parameters);
  for (DualMatrix* m : {&part.F, &part.g}) m->partial[static_cast<std::size_t>(parameters.first)] /= stages;
  return part;
}

}  // namespace

/// The gauge channel is late against the angle channel by tau [s]: y_d(t) = y(t - tau), as all-passes in a row, each of order six and the nearest to a delay by its part of tau, to the order
/// tau^13 (Pade). With two of them, in a stream, the phase is off by 2e-3 rad where 2 pi f tau = 11.8; elsewhere, with one, by 1e-3 rad at 5.9. Where a run starts anyhow (a pluck) the
/// filters' states are unknown: for tau the channel shows what was before the record, which is not the decay that follows. A gauge that is early shows as tau at its bound 0.
/// Source: G. A. Baker and P. Graves-Morris, Pade Approximants (1996), section 1.2.
Effect channel_delay() {
  Effect e;
  e.id = "channel-delay";
  e.summary = "gauge channel late against the angle channel";
  e.equation = "gauge(t) = y(t - tau)";
  e.kind = "signal";
  e.source = "Baker and Graves-Morris, Pade Approximants (1996), section 1.2";
  e.parameters = {{"time", "s", 0.004, 1e-4, 0.2, false, "Record a faster step of the angle."}};
  for (const double tau : {0.003, 0.008, 0.02, 0.05}) e.starts.push_back(Eigen::VectorXd::Constant(1, tau));
  e.draw = [](const AeroelasticModel&, double, Effect::Random& random) { return log_between(random, {{5e-4, 0.03}}); };
  e.states = [](const AeroelasticModel&, const Conditions& c) -> Eigen::Index { return order * stages_in(c); };
  e.acts = [](const Rig&, const Conditions&) { return true; };
  e.needs = Needs::beam;
  e.apply = [](LinearSystem& system, const EffectContext& c) {
    if (c.gauge < 0) return;
    const int stages = stages_in(c.conditions);
    for (int k = 0; k < stages; ++k) append_gauge_filter(system, c.gauge, stage(c.parameter(0), stages, {c.first_parameter, c.theta.size()}));
  };
  return e;
}

}  // namespace unrig
