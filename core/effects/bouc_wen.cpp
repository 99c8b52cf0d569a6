#include <cmath>

#include "core/effects/list.h"

namespace unrig {

namespace {

/// z' = v/x_y (1 - |z|^n (b + (1 - |b|) sign(v z))) at the arguments (v, z) and p = (F_y, x_y, b, n).
double rate_of_memory(const double* argument, const double* p, double* slope, double* partial) {
  const double v = argument[0], z = argument[1], yield = p[1], b = p[2], n = p[3];
  const double size = std::abs(z), side = v * z > 0 ? 1 : v * z < 0 ? -1 : 0, share = b + (1 - std::abs(b)) * side;
  const double power = size > 0 ? std::pow(size, n) : 0, per_velocity = (1 - power * share) / yield;
  slope[0] = per_velocity;
  slope[1] = size > 0 ? -v / yield * n * power / z * share : 0;
  partial[0] = 0;
  partial[1] = -v * per_velocity / yield;
  partial[2] = -v / yield * power * (1 - (b < 0 ? -side : side));
  partial[3] = size > 0 ? -v / yield * power * std::log(size) * share : 0;
  return v * per_velocity;
}

constexpr const char* sizes = "Record free decays that begin below and far above the yield displacement.";

}  // namespace

/// Hysteresis of the rig in its fundamental mode: F = -F_y z on the coordinate of the first normal mode, scaled to the element that the dead weights hung at,
/// z' = v/x_y (1 - |z|^n (b + (1 - |b|) sign(v z))), v [m/s] what that mode moves it by, z = 0 where a run begins. Small motions feel a spring of stiffness F_y/x_y.
/// With b >= 0 large motions feel dry friction F_y [N] and |z| stays below 1; x_y [m] lies between, n >= 1/2 is how sharply. With b < 0 the loop grows on: |z| stays below
/// (1 + 2 b)^(-1/n), from b = -1/2 down it has no bound. It is elastic at b = 1 and b = -1.
/// For a rig known only as modes, the first mode's coordinate.
/// Source: Y.-K. Wen, J. Engineering Mechanics 102 (1976) 249, Eq. 3, with A = 1, beta = b, gamma = 1 - |b|; bounds: F. Ikhouane and J. Rodellar, Systems with Hysteresis (2007), ch. 2.
Effect bouc_wen() {
  Effect e;
  e.id = "bouc-wen";
  e.summary = "hysteresis of the rig";
  e.equation = "F = -F_y z, z' = v/x_y (1 - |z|^n (b + (1 - |b|) sign(v z)))";
  e.kind = "memory";
  e.source = "Wen, J. Engineering Mechanics 102 (1976) 249";
  e.parameters = {{"force", "N", 0, 0, 1e6, false, sizes}, {"yield_displacement", "m", 1e-3, 1e-9, 1, false, sizes}, {"shape", "1", 0.5, -1, 1, false, sizes}, {"sharpness", "1", 1, 0.5, 4, false, sizes}};
  e.starts = {Eigen::Vector4d(0.1, 1e-3, 0.5, 1)};
  e.starts_for = [](const AeroelasticModel& model, double fastest) -> std::vector<Eigen::VectorXd> {  // a tenth of the elastic force, yielding at a tenth and a half of the motion
    const double force = 0.1 * first_mode_momentum(model) * fastest, widest = fastest / first_mode_frequency(model);
    return {Eigen::Vector4d(force, 0.1 * widest, 0.5, 1), Eigen::Vector4d(force, 0.5 * widest, 0.5, 1)};
  };
  e.draw = [](const AeroelasticModel& model, double release, Effect::Random& random) -> Eigen::VectorXd {  // beside the load and the deflection that release the pluck
    const double deflection = release / (first_mode_momentum(model) * first_mode_frequency(model));
    const Eigen::VectorXd p = log_between(random, {{0.003, 0.3}, {0.03, 0.5}, {0.1, 0.9}});
    return Eigen::Vector4d(p[0] * release, p[1] * deflection, p[2], 1);
  };
  e.states = [](const AeroelasticModel&, const Conditions&) -> Eigen::Index { return 1; };
  e.acts = [](const Rig&, const Conditions&) { return true; };
  e.apply = [](LinearSystem& system, const EffectContext& c) {
    const Eigen::RowVectorXd shape = first_mode(c.model, system.coordinates);
    DualMatrix force(Eigen::MatrixXd::Constant(1, 1, -c.parameter(0)), c.theta.size());
    force.add_partial(c.first_parameter, Eigen::MatrixXd::Constant(1, 1, -1));
    append_memory(system, port(system, c.ports.coordinate, shape[0]), force, {rate_of(system, shape), c.first_parameter, 4, rate_of_memory});
  };
  return e;
}

}  // namespace unrig
