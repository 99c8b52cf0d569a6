#include "core/effects/list.h"

namespace unrig {

namespace {

constexpr const char* steps = "Record a step of the angle and let it run for some hundred semichords.";

}  // namespace

/// Slow loss of lift after a change of the angle, while the separation point moves forward along the suction side: of the circulatory force on a strip the
/// share D of what the downwash w would give in the end is lost with the time constant T_s in semichords, N -= s rho U b l D y, y' = (U / b T_s) (w - y), so that
/// phi(s) -> phi(s) - D (1 - exp(-s/T_s)). D and T_s are shared by all runs in a stream, at any angle.
/// D is not negative: lift that comes late is no loss but a build-up of its own (core/effects/wagner_lag.cpp).
/// Source: J. G. Leishman and T. S. Beddoes, J. American Helicopter Society 34(3) (1989) 3 (first-order lag of the trailing-edge separation point).
Effect separation_lag() {
  Effect e;
  e.id = "separation-lag";
  e.summary = "slow loss of lift after a step";
  e.equation = "phi(s) -> phi(s) - D (1 - exp(-s/T_s))";
  e.kind = "lift";
  e.source = "Leishman and Beddoes, J. American Helicopter Society 34(3) (1989) 3";
  e.parameters = {{"loss", "1", 0, 0, 2, false, steps}, {"time", "1", 10, 0.5, 300, false, steps}};
  for (const double s : {4.0, 10.0, 25.0}) e.starts.push_back(Eigen::Vector2d(0.1, s));
  e.draw = [](const AeroelasticModel&, double, Effect::Random& random) { return log_between(random, {{0.01, 0.4}, {4, 40}}); };
  e.states = [](const AeroelasticModel& model, const Conditions&) -> Eigen::Index { return model.circulation().rate.size() > 0 ? static_cast<Eigen::Index>(model.rig().submerged.size()) : 0; };
  e.acts_in = "a run in a stream";
  e.acts = [](const Rig&, const Conditions& c) { return c.speed > 0; };
  e.in_the_load = true;
  e.needs = Needs::beam;
  e.apply = [](LinearSystem& system, const EffectContext& c) {
    if (system.lags == 0) return;
    const double loss = c.parameter(0), time = c.parameter(1);
    const Eigen::Index lag = append_lag(system, c, c.on_strips(1, 1 / time, -1 / (time * time)));
    DualMatrix lost(Eigen::MatrixXd::Zero(c.ports.strips, system.states()), c.theta.size());
    lost.set_block(0, lag, c.on_strips(0, -loss, -1));
    add_circulation(system, c, {lost, DualMatrix(Eigen::MatrixXd::Zero(c.ports.strips, system.B.cols()), c.theta.size())});
  };
  return e;
}

}  // namespace unrig
