#include "core/effects/list.h"

namespace unrig {

namespace {

/// -k a^3
double cube(double a, const double* p, double& slope, double* partial) {
  slope = -3 * p[0] * a * a;
  partial[0] = -a * a * a;
  return -p[0] * a * a * a;
}

}  // namespace

/// A lift curve that bends: with a_E the angle of attack that circulation has caught up with on a strip,
///
///   a_E = (1/U) Int phi(U(t-t')/b) dw(t'),   C_N = s (a_E - k a_E^3),
///
/// counted from that before the motion; w and s as in AeroelasticModel, phi Wagner's function, also where the build-up is searched. k [1/rad^2] is shared by the runs, s is the slope of each run's normal force.
/// Source: J. G. Leishman and T. S. Beddoes, J. American Helicopter Society 34(3) (1989) 3 (the static curve at the effective angle).
Effect lift_curve() {
  Effect e;
  e.id = "lift-curve";
  e.summary = "lift that bends away from a straight line as the angle grows";
  e.equation = "C_N = s (a_E - k a_E^3)";
  e.kind = "lift";
  e.source = "Leishman and Beddoes, J. American Helicopter Society 34(3) (1989) 3";
  e.parameters = {{"bend", "1/rad^2", 0, -1e30, 1e30, false, "Record steps of several sizes."}};
  for (const double k : {5.0, 50.0, -20.0}) e.starts.push_back(Eigen::VectorXd::Constant(1, k));
  e.draw = [](const AeroelasticModel&, double, Effect::Random& random) -> Eigen::VectorXd { return Eigen::VectorXd::Constant(1, log_between(random, 1, 80)); };
  e.acts_in = "a run in a stream";
  e.acts = [](const Rig&, const Conditions& c) { return c.speed > 0; };
  e.in_the_load = true;
  e.needs = Needs::beam;
  e.apply = [](LinearSystem& system, const EffectContext& c) {
    if (system.lags == 0) return;
    const Eigen::MatrixXd angle = caught_up_angle(system, c);
    for (Eigen::Index s = 0; s < c.ports.strips; ++s) {
      const DualMatrix ports = c.conditions.speed * circulation_ports(system, c);  // anew: each force is a further input
      append_feedback(system, ports.block(0, s, ports.rows(), 1), {angle.row(s), c.first_parameter, 1, of_one<cube>});
    }
  };
  return e;
}

}  // namespace unrig
