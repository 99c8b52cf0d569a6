#include <cmath>

#include "core/effects/list.h"

namespace unrig {

namespace {

/// -C_d |v| v
double drag(double v, const double* p, double& slope, double* partial) {
  slope = -2 * p[0] * std::abs(v);
  partial[0] = -std::abs(v) * v;
  return -p[0] * std::abs(v) * v;
}

}  // namespace

/// Drag of the section that moves across the fluid: F = -C_d rho/2 c l |h'| h' on every strip, h' the normal velocity of the strip [m/s]. For a rig known only as modes
/// a generalised force -C_d |q'| q' on each mode's coordinate, C_d then in units of that force over velocity squared (N s^2/m^2).
/// Source: J. R. Morison et al., Petroleum Transactions 189 (1950) 149 (drag term).
Effect quadratic_drag() {
  Effect e;
  e.id = "quadratic-drag";
  e.summary = "drag of the moving section, force ~ velocity times its magnitude";
  e.equation = "F = -C_d (rho/2) c l |h'| h' on each strip";
  e.kind = "damping";
  e.source = "Morison et al., Petroleum Transactions 189 (1950) 149";
  e.parameters = {{"coefficient", "1", 0, 0, 1e4, false, "Record free decays in the fluid from a small and from a large load."}};
  e.starts = {Eigen::VectorXd::Constant(1, 2.0)};
  e.draw = [](const AeroelasticModel&, double, Effect::Random& random) { return log_between(random, {{0.3, 20}}); };
  e.acts_in = "a liquid: in a gas the drag of strips is a thousand times less and drowns in the damping of the rig (damping that grows with amplitude there is cubic-damping)";
  constexpr double liquid = 100;  // kg/m^3, between every gas and every liquid at rest in a laboratory
  e.acts = [](const Rig& rig, const Conditions& c) { return rig.is_modal() || c.density > liquid; };
  e.apply = [](LinearSystem& system, const EffectContext& c) {
    const Rig& rig = c.model.rig();
    const Eigen::Index n = system.coordinates;
    if (rig.is_modal()) {
      for (Eigen::Index i = 0; i < n; ++i) append_feedback(system, port(system, c.ports.coordinate + i, 1), {rate_of(system, Eigen::RowVectorXd::Unit(n, i)), c.first_parameter, 1, of_one<drag>});
      return;
    }
    const double per_strip = 0.5 * c.conditions.density * 2 * rig.semichord() * rig.strip_length;
    for (Eigen::Index s = 0; s < c.ports.strips; ++s) {
      const Eigen::RowVectorXd shape = c.model.basis().normal.row(rig.submerged[static_cast<std::size_t>(s)] - 1);
      append_feedback(system, port(system, c.ports.strip + s, per_strip), {rate_of(system, shape), c.first_parameter, 1, of_one<drag>});
    }
  };
  return e;
}

}  // namespace unrig
