#include <numbers>

#include "core/effects/list.h"

namespace unrig {

namespace {

/// 2 e a at the arguments (e, a)
double surge(const double* argument, const double*, double* slope, double*) {
  slope[0] = 2 * argument[1];
  slope[1] = 2 * argument[0];
  return 2 * argument[0] * argument[1];
}

constexpr const char* several_steps = "Record steps of several sizes at one speed.";

}  // namespace

/// A carriage whose speed surges, U (1 + e(t)) with e = a cos(2 pi f t) + b sin(2 pi f t). Dynamic pressure grows by 2 e, and with it the steady and the circulatory load:
///
///   dN = 2 e q l c (C_N0 + s a_E)   on each strip, q = rho U^2 / 2,
///
/// s the slope of the run's normal force, a_E the angle that circulation has caught up with, counted from that before the motion (core/effects/lift_curve.cpp). f [Hz] is shared by the
/// runs; a, b and C_N0, the normal-force coefficient before the motion, belong to each. Quasi-steady: what a surge does to the build-up of circulation is left out, as is e^2.
/// Source: J. M. Greenberg, NACA TN 1326 (1947), of which this is the quasi-steady part of first order in e.
Effect speed_surge() {
  Effect e;
  e.id = "speed-surge";
  e.summary = "speed that surges, and with it the dynamic pressure";
  e.equation = "N -> (1 + 2 e) N of the steady and the circulatory load, e = a cos 2 pi f t + b sin 2 pi f t";
  e.kind = "speed";
  e.source = "Greenberg, NACA TN 1326 (1947)";
  e.parameters = {{"frequency", "Hz", 1, 0.05, 50, false, "Record a longer run in the stream."}, {"steady_normal_force", "1", 0.3, -5, 5, true, several_steps}};
  e.starts = {Eigen::Vector2d(1, 0.3)};
  e.frequency = [](const AeroelasticModel&, const Conditions&, const Eigen::VectorXd& p) { return p[0]; };
  e.draw = [](const AeroelasticModel&, double, Effect::Random& random) { return log_between(random, {{0.3, 8}, {0.1, 0.8}}); };
  e.states = [](const AeroelasticModel&, const Conditions&) -> Eigen::Index { return 2; };
  e.acts_in = "a run in a stream";
  e.acts = [](const Rig&, const Conditions& c) { return c.speed > 0; };
  e.needs = Needs::beam;
  e.apply = [](LinearSystem& system, const EffectContext& c) {
    const double per_hertz = 2 * std::numbers::pi;
    const Eigen::Matrix2d turn = (Eigen::Matrix2d() << 0, 1, -1, 0).finished();
    DualMatrix F(c.parameter(0) * per_hertz * turn, c.theta.size());
    F.add_partial(c.first_parameter, per_hertz * turn);
    const Rig& rig = c.model.rig();
    const double pressure = 0.5 * c.conditions.density * c.conditions.speed * c.conditions.speed, per_coefficient = 2 * pressure * 2 * rig.semichord() * rig.strip_length;
    std::vector<Eigen::Index> strips;
    for (Eigen::Index s = 0; s < c.ports.strips; ++s) strips.push_back(c.ports.strip + s);
    const Eigen::MatrixXd share = Eigen::VectorXd::Constant(c.ports.strips, per_coefficient) * Eigen::RowVector2d(1, 0);
    DualMatrix steady(c.parameter(1) * share, c.theta.size());
    steady.add_partial(c.first_parameter + 1, share);
    const Eigen::Index signal = append_signal(system, F, strips, steady);
    if (system.lags == 0) return;
    const Eigen::MatrixXd angle = caught_up_angle(system, c);
    for (Eigen::Index s = 0; s < c.ports.strips; ++s) {
      const DualMatrix ports = c.conditions.speed * circulation_ports(system, c);  // anew: each force is a further input
      Eigen::MatrixXd sees = Eigen::MatrixXd::Zero(2, system.states());
      sees(0, signal) = 1;
      sees.row(1) = angle.row(s);
      append_feedback(system, ports.block(0, s, ports.rows(), 1), {std::move(sees), c.first_parameter, 0, surge});
    }
  };
  return e;
}

}  // namespace unrig
