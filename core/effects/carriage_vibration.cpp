#include <numbers>

#include "core/effects/list.h"

namespace unrig {

/// The mount itself is shaken while the carriage runs: heave of the mount at f = kappa U, kappa [1/m] the number of periods per metre of track (wheel, rail joint, tooth of the
/// drive), shared; amplitude and phase belong to each run.
/// Source: inertial forcing by a moving support, R. D. Blevins, Flow-Induced Vibration (1990), chapter 7.
Effect carriage_vibration() {
  Effect e;
  e.id = "carriage-vibration";
  e.summary = "the mount itself is shaken, at a frequency tied to carriage speed";
  e.equation = "mount velocity = a cos 2 pi f t + b sin 2 pi f t, f = kappa U";
  e.kind = "signal";
  e.source = "Blevins, Flow-Induced Vibration (1990), chapter 7";
  e.parameters = {{"periods_per_length", "1/m", 10, 0.8, 120, false, "Record a run in the stream at another speed."}};
  e.starts = {Eigen::VectorXd::Constant(1, 10)};
  e.frequency = [](const AeroelasticModel&, const Conditions& c, const Eigen::VectorXd& p) { return p[0] * c.speed; };
  e.draw = [](const AeroelasticModel&, double, Effect::Random& random) { return log_between(random, {{3, 40}}); };
  e.states = [](const AeroelasticModel&, const Conditions&) -> Eigen::Index { return 2; };
  e.acts_in = "a run in a stream";
  e.acts = [](const Rig&, const Conditions& c) { return c.speed > 0; };
  e.needs = Needs::beam;
  e.apply = [](LinearSystem& system, const EffectContext& c) {
    const double per_kappa = 2 * std::numbers::pi * c.conditions.speed, omega = c.parameter(0) * per_kappa;
    const Eigen::Matrix2d turn = (Eigen::Matrix2d() << 0, 1, -1, 0).finished();
    DualMatrix F(omega * turn, c.theta.size());
    F.add_partial(c.first_parameter, per_kappa * turn);
    DualMatrix shaken((Eigen::Matrix2d() << 1, 0, 0, omega).finished(), c.theta.size());  // velocity z1, acceleration z1' = omega z2
    shaken.add_partial(c.first_parameter, (Eigen::Matrix2d() << 0, 0, 0, per_kappa).finished());
    append_signal(system, F, {c.ports.mount, c.ports.mount + 1}, shaken);
  };
  return e;
}

}  // namespace unrig
