#include "core/effects/list.h"

namespace unrig {

/// A bridge that is not purely sensitive to the normal force: gauge += kappa M_t with M_t [N m] the torque in the shaft at the bridge, the sum of the elastic
/// torques of all torsional modes, M_t = kt sum_k omega_k^2 g_k sum_{j outboard} J_j phi_jk. kappa [1/m] is shared.
/// Source: seed, section 1.2 (the circuit is compensated to be sensitive to chord-normal forces only; here it is not).
Effect torsion_crosstalk() {
  Effect e;
  e.id = "torsion-crosstalk";
  e.summary = "bridge not purely sensitive to the normal force";
  e.equation = "gauge += kappa M_t";
  e.kind = "signal";
  e.source = "seed, section 1.2";
  e.parameters = {{"per_torque", "1/m", 0, -50, 50, false, "Record a run that excites torsion: a rapid step, or a pluck off the pitch axis."}};
  e.starts = {Eigen::VectorXd::Zero(1)};
  e.needs = Needs::beam;
  e.draw = [](const AeroelasticModel&, double, Effect::Random& random) { return log_between(random, {{0.05, 10}}); };
  e.acts = [](const Rig&, const Conditions&) { return true; };
  e.apply = [](LinearSystem& system, const EffectContext& c) {
    const Rig& rig = c.model.rig();
    if (c.gauge < 0 || rig.is_modal()) return;
    const Basis& basis = c.model.basis();
    const Eigen::Index stiffness = c.model.index("torsion.stiffness_scale"), first = basis.normal_modes;
    const Modes torsion = chain_modes(rig.torsion);
    Eigen::RowVectorXd torque = Eigen::RowVectorXd::Zero(system.states());  // per unit stiffness scale
    for (Eigen::Index k = 0; k < basis.torsion_modes; ++k)
      for (Eigen::Index j = std::min<Eigen::Index>(rig.gauge_element, rig.rigid_from) - 1; j < rig.torsion.inertia.size(); ++j)
        torque[first + k] += basis.omega[first + k] * basis.omega[first + k] * rig.torsion.inertia[j] * torsion.shape(j, k);
    const double kappa = c.parameter(0), scale = c.theta[stiffness];
    DualMatrix row(kappa * scale * torque, c.theta.size());
    row.add_partial(c.first_parameter, scale * torque);
    row.add_partial(stiffness, kappa * torque);
    DualMatrix sum = system.C.block(c.gauge, 0, 1, system.states()) + row;
    for (Eigen::MatrixXd& partial : system.C.partial)
      if (partial.size() > 0) partial.row(c.gauge).setZero();
    system.C.set_block(c.gauge, 0, sum);
  };
  return e;
}

}  // namespace unrig
