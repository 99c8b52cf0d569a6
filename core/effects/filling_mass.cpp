#include "core/effects/list.h"

namespace unrig {

namespace {

/// z' = (1 - z)/tau
double fills(double z, const double* p, double& slope, double* partial) {
  slope = -1 / p[0];
  partial[0] = -(1 - z) / (p[0] * p[0]);
  return (1 - z) / p[0];
}

/// -m z a at the arguments (a, z) and p = (m)
double inertia(const double* argument, const double* p, double* slope, double* partial) {
  slope[0] = -p[0] * argument[1];
  slope[1] = -p[0] * argument[0];
  partial[0] = -argument[0] * argument[1];
  return -p[0] * argument[0] * argument[1];
}

constexpr const char* longer = "Record a longer decay in the liquid, released as it is lowered in.";

}  // namespace

/// Mass that changes with time, as of a hollow section that fills: F = -m (1 - exp(-t/tau)) a on the coordinate of the first normal mode, scaled to the element that the dead weights hung at;
/// a [m/s^2] the acceleration of that mode, t [s] from the first sample of the run. m [kg] is what has come in in the end, negative where it runs out. It needs a liquid.
/// Against a moving mount a is that beside it. For a rig known only as modes, the first mode's coordinate.
/// What comes in has the velocity of the body, so that there is no thrust; it comes in at a rate proportional to what is missing.
/// Source: A. Sommerfeld, Mechanics (1952), section 4 (variable mass).
Effect filling_mass() {
  Effect e;
  e.id = "filling-mass";
  e.summary = "mass that changes with time, as of a section that fills";
  e.equation = "F = -m (1 - exp(-t/tau)) a";
  e.kind = "inertia";
  e.source = "Sommerfeld, Mechanics (1952), section 4";
  e.parameters = {{"mass", "kg", 0, -1e6, 1e6, false, longer}, {"time", "s", 1, 0.02, 1e3, false, longer}};
  for (const double tau : {0.5, 3.0}) e.starts.push_back(Eigen::Vector2d(0.05, tau));
  e.starts_for = [](const AeroelasticModel& model, double) -> std::vector<Eigen::VectorXd> {  // some per cent of what moves
    return {Eigen::Vector2d(0.03 * first_mode_mass(model), 0.5), Eigen::Vector2d(0.03 * first_mode_mass(model), 3)};
  };
  e.draw = [](const AeroelasticModel& model, double, Effect::Random& random) -> Eigen::VectorXd {
    const Eigen::VectorXd p = log_between(random, {{0.003, 0.1}, {0.3, 8}});
    return Eigen::Vector2d(p[0] * first_mode_mass(model), p[1]);
  };
  e.states = [](const AeroelasticModel&, const Conditions&) -> Eigen::Index { return 1; };
  e.acts_in = "a run in a fluid of more than 100 kg/m^3";
  e.acts = [](const Rig&, const Conditions& c) { return c.density > 100; };
  e.apply = [](LinearSystem& system, const EffectContext& c) {
    const Eigen::RowVectorXd shape = first_mode(c.model, system.coordinates);
    const DualMatrix direction = port(system, c.ports.coordinate, shape[0]), no_force(Eigen::MatrixXd::Zero(1, 1), c.theta.size());
    const Eigen::Index share = append_memory(system, direction, no_force, {Eigen::MatrixXd(0, system.states()), c.first_parameter + 1, 1, of_one<fills>});
    Feedback force{Eigen::MatrixXd::Zero(2, system.states()), c.first_parameter, 1, inertia};
    force.sees(1, share) = 1;
    force.sees_rates = Eigen::MatrixXd::Zero(2, system.states());
    force.sees_rates.row(0) = rate_of(system, shape);
    append_feedback(system, port(system, c.ports.coordinate, shape[0]), std::move(force));
  };
  return e;
}

}  // namespace unrig
