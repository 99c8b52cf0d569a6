#include "core/effects/list.h"

namespace unrig {

/// Springs whose line of action passes beside the pitch axis: a displacement h [m] of the section makes the couple M = -k_c h, its elastic twist theta [rad] the force F = -k_c theta;
/// k_c [N/rad] is the normal stiffness times the arm. h is that of the first normal mode at the calibration element (without one, the first element), theta that of the first torsional
/// mode at the outermost strip. Without a channel that reads the twist it hardly shows.
/// Source: R. L. Bisplinghoff, H. Ashley, R. L. Halfman, Aeroelasticity (1955) (elastic axis and reference axis apart).
Effect elastic_coupling() {
  Effect e;
  e.id = "elastic-coupling";
  e.summary = "springs that act beside the pitch axis";
  e.equation = "F = -k_c theta, M = -k_c h";
  e.kind = "stiffness";
  e.source = "Bisplinghoff, Ashley and Halfman, Aeroelasticity (1955)";
  e.parameters = {{"stiffness", "N/rad", 0, -1e9, 1e9, false, "Record a pluck off the pitch axis, with a sensor of the twist."}};
  e.starts = {Eigen::VectorXd::Zero(1)};
  e.needs = Needs::twist_reading;
  e.draw = [](const AeroelasticModel& model, double, Effect::Random& random) -> Eigen::VectorXd {  // the springs beside the axis by up to a third of the semichord
    const double stiffness = first_mode_momentum(model) * model.basis().omega[0];
    return Eigen::VectorXd::Constant(1, stiffness * model.rig().semichord() * log_between(random, 1e-3, 0.3));
  };
  e.acts = [](const Rig&, const Conditions&) { return true; };
  e.apply = [](LinearSystem& system, const EffectContext& c) {
    const Basis& basis = c.model.basis();
    if (basis.torsion_modes < 1 || basis.normal_modes < 1) return;
    const Eigen::Index n = system.coordinates, twist = basis.normal_modes;
    const Eigen::RowVectorXd h = first_mode(c.model, n), theta = basis.twist(c.model.rig().submerged.back() - 1, twist) * Eigen::RowVectorXd::Unit(n, twist);
    const Eigen::MatrixXd per_stiffness = -(h.transpose() * theta + theta.transpose() * h);
    Eigen::MatrixXd push = Eigen::MatrixXd::Zero(system.B.cols(), system.states());
    push.block(c.ports.coordinate, 0, n, n) = per_stiffness;
    DualMatrix feedback(c.parameter(0) * push, c.theta.size());
    feedback.add_partial(c.first_parameter, push);
    system.A = system.A + system.B * feedback;
    system.C = system.C + system.D * feedback;
  };
  return e;
}

}  // namespace unrig
