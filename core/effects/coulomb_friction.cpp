#include <cmath>

#include "core/effects/list.h"

namespace unrig {

namespace {

constexpr const char* small_motions = "Record free decays until they stand still, from a small load too.";

/// -F tanh(v / v_s)
double friction(double v, const double* p, double& slope, double* partial) {
  const double t = std::tanh(v / p[1]), bell = 1 - t * t;
  slope = -p[0] * bell / p[1];
  partial[0] = -t;
  partial[1] = p[0] * bell * v / (p[1] * p[1]);
  return -p[0] * t;
}

}  // namespace

/// Dry friction of the rig in its fundamental mode: F = -F_c tanh(v/v_s) on the coordinate of the first normal mode, scaled to the element that the dead weights hung at: v [m/s] is what
/// that mode moves it by, and F_c [N] the sliding force there; below v_s [m/s] it does not slide fully. For a rig known only as modes, the first mode's coordinate.
/// Source: C.-A. de Coulomb (1781); smoothed as in E. Pennestri et al., Nonlinear Dynamics 83 (2016) 1785.
Effect coulomb_friction() {
  Effect e;
  e.id = "coulomb-friction";
  e.summary = "dry friction in the rig";
  e.equation = "F = -F_c tanh(v/v_s)";
  e.kind = "friction";
  e.source = "Coulomb (1781); Pennestri et al., Nonlinear Dynamics 83 (2016) 1785";
  e.parameters = {{"force", "N", 0, 0, 1e4, false, small_motions}, {"velocity", "m/s", 1e-3, 1e-6, 1, false, small_motions}};
  e.starts = {Eigen::Vector2d(0.1, 1e-3)};
  e.starts_for = [](const AeroelasticModel& model, double fastest) -> std::vector<Eigen::VectorXd> {  // as much as a damping ratio near 0.01
    const double force = 0.01 * first_mode_momentum(model) * fastest;
    std::vector<Eigen::VectorXd> starts;
    for (const double share : {0.06, 0.02, 0.006, 0.002}) starts.emplace_back(Eigen::Vector2d(force, share * fastest));
    return starts;
  };
  e.draw = [](const AeroelasticModel& model, double release, Effect::Random& random) -> Eigen::VectorXd {  // beside the load that releases the pluck, and the speed it gives
    const double fastest = release / first_mode_momentum(model);
    return Eigen::Vector2d(log_between(random, 1e-3, 0.1) * release, 0.01 * fastest);
  };
  e.acts = [](const Rig&, const Conditions&) { return true; };
  e.apply = [](LinearSystem& system, const EffectContext& c) {
    const Eigen::RowVectorXd shape = first_mode(c.model, system.coordinates);
    append_feedback(system, port(system, c.ports.coordinate, shape[0]), {rate_of(system, shape), c.first_parameter, 2, of_one<friction>});
  };
  return e;
}

}  // namespace unrig
