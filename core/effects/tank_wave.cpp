#include <cmath>
#include <numbers>

#include "core/effects/list.h"

namespace unrig {

/// Decaying sloshing wave of the tank: f(t) = exp(-t/tau) (a cos(2 pi f t) + b sin(2 pi f t)) on the submerged section, spread evenly over it. Frequency f [Hz] and
/// decay time tau [s] are those of the tank and shared by all runs in it; a and b [N] belong to each run. The force is the state of a damped
/// oscillator, z'' + 2 z'/tau + ((2 pi f)^2 + 1/tau^2) z = 0, whose initial value is unknown. It needs water.
/// Source: O. M. Faltinsen and A. N. Timokha, Sloshing, Cambridge 2009, chapter 1 (natural sloshing modes decay exponentially).
Effect tank_wave() {
  Effect e;
  e.id = "tank-wave";
  e.summary = "decaying sloshing wave of the tank";
  e.equation = "F(t) = exp(-t/tau) (a cos 2 pi f t + b sin 2 pi f t) on the strips";
  e.kind = "signal";
  e.source = "Faltinsen and Timokha, Sloshing (2009), chapter 1";
  e.parameters = {{"frequency", "Hz", 0.5, 0.05, 5, false, "Record a longer run in the fluid."}, {"decay_time", "s", 8, 0.3, 1e3, false, "Record a longer run in the fluid."}};
  for (const double tau : {3.0, 12.0}) e.starts.push_back(Eigen::Vector2d(0.5, tau));
  e.frequency = [](const AeroelasticModel&, const Conditions&, const Eigen::VectorXd& p) { return p[0]; };
  e.needs = Needs::beam;
  e.draw = [](const AeroelasticModel&, double, Effect::Random& random) { return log_between(random, {{0.2, 1.5}, {3, 15}}); };
  e.states = [](const AeroelasticModel&, const Conditions&) -> Eigen::Index { return 2; };
  e.acts_in = "a run in a fluid of more than 100 kg/m^3";
  e.acts = [](const Rig&, const Conditions& c) { return c.density > 100; };
  e.apply = [](LinearSystem& system, const EffectContext& c) {
    constexpr double pi = std::numbers::pi;
    const double f = c.parameter(0), tau = c.parameter(1), omega = 2 * pi * f;
    const Eigen::Index p = c.first_parameter;
    // Two states that rotate and decay: z' = [-1/tau, omega; -omega, -1/tau] z.
    DualMatrix F((Eigen::Matrix2d() << -1 / tau, omega, -omega, -1 / tau).finished(), c.theta.size());
    F.add_partial(p, (Eigen::Matrix2d() << 0, 2 * pi, -2 * pi, 0).finished());
    F.add_partial(p + 1, Eigen::Matrix2d::Identity() / (tau * tau));
    append_strip_signal(system, c, F, Eigen::RowVector2d(1, 0));
  };
  return e;
}

}  // namespace unrig
