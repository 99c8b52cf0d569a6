#include "core/effects/list.h"

namespace unrig {

namespace {

/// -c v^3
double cube(double v, const double* p, double& slope, double* partial) {
  slope = -3 * p[0] * v * v;
  partial[0] = -v * v * v;
  return -p[0] * v * v * v;
}

}  // namespace

/// Damping of the fundamental mode that grows with amplitude, as joints and clamps have it: F = -c_3 v^3 on the coordinate of the first normal mode, scaled to the element that the
/// dead weights hung at: v [m/s] is what that mode moves it by, c_3 [N s^3/m^3]. It needs no fluid. For a rig known only as modes, the first mode's coordinate.
/// Source: Lord Rayleigh, Philosophical Magazine 15 (1883) 229 (resistance with the cube of the velocity).
Effect cubic_damping() {
  Effect e;
  e.id = "cubic-damping";
  e.summary = "damping that grows with amplitude, as in joints";
  e.equation = "F = -c_3 v^3";
  e.kind = "damping";
  e.source = "Rayleigh, Philosophical Magazine 15 (1883) 229";
  e.parameters = {{"coefficient", "N.s^3/m^3", 0, 0, 1e30, false, "Record free decays from a small and from a large load."}};
  e.starts = {Eigen::VectorXd::Constant(1, 1.0)};
  e.starts_for = [](const AeroelasticModel& model, double fastest) -> std::vector<Eigen::VectorXd> {  // as much as a damping ratio near 0.01
    return {Eigen::VectorXd::Constant(1, 0.01 * first_mode_momentum(model) / (fastest * fastest))};
  };
  e.draw = [](const AeroelasticModel& model, double release, Effect::Random& random) -> Eigen::VectorXd {  // beside the load that releases the pluck, at the speed it gives
    const double fastest = release / first_mode_momentum(model);
    return Eigen::VectorXd::Constant(1, log_between(random, 1e-3, 0.3) * release / (fastest * fastest * fastest));
  };
  e.acts = [](const Rig&, const Conditions&) { return true; };
  e.apply = [](LinearSystem& system, const EffectContext& c) {
    const Eigen::RowVectorXd shape = first_mode(c.model, system.coordinates);
    append_feedback(system, port(system, c.ports.coordinate, shape[0]), {rate_of(system, shape), c.first_parameter, 1, of_one<cube>});
  };
  return e;
}

}  // namespace unrig
