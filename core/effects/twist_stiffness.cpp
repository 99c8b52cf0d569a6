#include <cmath>

#include "core/effects/cubic_law.h"
#include "core/effects/list.h"

namespace unrig {

namespace {

constexpr const char* large = "Record runs with small and with large twist, with a sensor of it.";

/// Stiffness of the first torsional mode as the section feels it [N m/rad].
double torsional_stiffness(const AeroelasticModel& model) {
  const Basis& basis = model.basis();
  return std::pow(basis.omega[basis.normal_modes] / basis.twist(model.rig().submerged.back() - 1, basis.normal_modes), 2);
}

}  // namespace

/// Torsional stiffness that changes with amplitude: M = -k_3 ((theta + d)^3 - d^3), theta the elastic twist [rad] of the section in the first torsional mode from where it stands
/// at rest, d [rad] how far that is from the spring's point of symmetry, the same in all runs; k_3 [N m/rad^3], negative where the rig softens. The couple acts on that mode.
/// Without a channel that reads the twist it hardly shows.
/// Source: B. H. K. Lee, S. J. Price, Y. S. Wong, Progress in Aerospace Sciences 35 (1999) 205 (cubic restoring forces in pitch).
Effect twist_stiffness() {
  Effect e;
  e.id = "twist-stiffness";
  e.summary = "torsional stiffness that changes with amplitude";
  e.equation = "M = -k_3 ((theta + d)^3 - d^3)";
  e.kind = "stiffness";
  e.source = "Lee, Price and Wong, Progress in Aerospace Sciences 35 (1999) 205";
  e.parameters = {{"coefficient", "N.m/rad^3", 0, -1e30, 1e30, false, large}, {"offset", "rad", 0, -1, 1, false, large}};
  e.starts = {Eigen::Vector2d(0, 0)};
  e.starts_for = [](const AeroelasticModel& model, double widest) -> std::vector<Eigen::VectorXd> {  // a tenth of the linear couple at the largest twist, symmetric or not
    const double k = 0.1 * torsional_stiffness(model) / (widest * widest);
    return {Eigen::Vector2d(k, 0.3 * widest), Eigen::Vector2d(k, -0.3 * widest), Eigen::Vector2d(k, 0), Eigen::Vector2d(-k, 0)};
  };
  e.needs = Needs::twist_reading;
  e.draw = [](const AeroelasticModel& model, double release, Effect::Random& random) -> Eigen::VectorXd {  // beside the twist that the load makes half a semichord from the axis
    const double stiffness = torsional_stiffness(model), twist = release * 0.5 * model.rig().semichord() / stiffness;
    const Eigen::VectorXd p = log_between(random, {{1e-2, 5}, {0.1, 1}});
    return Eigen::Vector2d(p[0] * stiffness / (twist * twist), p[1] * twist);
  };
  e.acts = [](const Rig&, const Conditions&) { return true; };
  e.apply = [](LinearSystem& system, const EffectContext& c) {
    const Basis& basis = c.model.basis();
    if (basis.torsion_modes < 1) return;
    const Eigen::Index first = basis.normal_modes;
    const double shape = basis.twist(c.model.rig().submerged.back() - 1, first);
    append_feedback(system, port(system, c.ports.coordinate + first, shape), {displacement_of(system, shape * Eigen::RowVectorXd::Unit(system.coordinates, first)), c.first_parameter, 2, of_one<cubic_law>});
  };
  return e;
}

}  // namespace unrig
