#include "core/effects/cubic_law.h"
#include "core/effects/list.h"

namespace unrig {

/// Stiffness of the fundamental mode that changes with amplitude: F = -k_3 ((h + d)^3 - d^3) on the coordinate of the first normal mode, scaled to the element that the dead weights
/// hung at: h [m] is what that mode displaces it by from where it stood before the run, d how far that was from the unloaded position [m], of each run in a
/// stream; k_3 [N/m^3], negative where the rig softens. For a rig known only as modes, the first mode's coordinate.
/// Source: G. Duffing, Erzwungene Schwingungen (1918).
Effect cubic_stiffness() {
  Effect e;
  e.id = "cubic-stiffness";
  e.summary = "stiffness that changes with amplitude";
  e.equation = "F = -k_3 ((h + d)^3 - d^3)";
  e.kind = "stiffness";
  e.source = "Duffing, Erzwungene Schwingungen (1918)";
  e.parameters = {{"coefficient", "N/m^3", 0, -1e30, 1e30, false, "Record free decays from a small and from a large load."}, {"static_displacement", "m", 0, -1, 1, true, "Record a run at this steady load with larger motions."}};
  e.terms = {{1}};
  e.starts = {Eigen::Vector2d(0, 0)};
  e.draw = [](const AeroelasticModel& model, double release, Effect::Random& random) -> Eigen::VectorXd {  // share of the linear force where the pluck is released
    const double stiffness = first_mode_momentum(model) * model.basis().omega[0], deflection = release / stiffness;
    return Eigen::Vector2d(log_between(random, 1e-3, 0.5) * stiffness / (deflection * deflection), 0);
  };
  e.acts = [](const Rig&, const Conditions&) { return true; };
  e.apply = [](LinearSystem& system, const EffectContext& c) {
    const Eigen::RowVectorXd shape = first_mode(c.model, system.coordinates);
    append_feedback(system, port(system, c.ports.coordinate, shape[0]), {displacement_of(system, shape), c.first_parameter, 2, of_one<cubic_law>});
  };
  return e;
}

}  // namespace unrig
