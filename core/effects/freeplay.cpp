#include <algorithm>
#include <cmath>

#include "core/effects/list.h"

namespace unrig {

namespace {

constexpr double rounding = 0.003;  // of a corner, as a share of the gap, for searches to follow its slopes
constexpr Eigen::Index steps = 4;  // within a sample, in which the section may cross the whole gap: 3e-4 of the motion is missed at 20 samples a period, as in eight along straight lines

/// What the gap takes from the deflection: z within it, the gap beyond.
double gap(double z, const double* p, double& slope, double* partial) {
  const bool inside = std::abs(z) < p[0];
  slope = inside ? 1 : 0;
  partial[0] = inside ? 0 : (z > 0 ? 1 : -1);
  return std::clamp(z, -p[0], p[0]);
}

/// The same, but between |z| = (1 -+ rounding) p0 along the parabola that joins both smoothly.
double rounded_gap(double z, const double* p, double& slope, double* partial) {
  const double half = p[0], width = rounding * half, beyond = std::abs(z) - half, side = z > 0 ? 1 : -1;
  if (std::abs(beyond) < width) {
    const double short_of = width - beyond;  // of where the corner ends
    slope = short_of / (2 * width);
    // f = p0 - short_of^2 / (4 width), short_of = (1 + rounding) p0 - |z|
    partial[0] = side * (1 - short_of * (1 + rounding) / (2 * width) + short_of * short_of / (4 * width * half));
    return side * (half - short_of * short_of / (4 * width));
  }
  return gap(z, p, slope, partial);
}

}  // namespace

/// A gap in the torsional drive: the elastic couple acts on the twist beyond the gap only, M = -k (theta - clamp(theta, -delta, delta)), theta the elastic twist [rad] of
/// the section in the first torsional mode, delta half the gap [rad], k that mode's stiffness; a fit rounds the corners from 0.997 to 1.003 delta. The gap is centred where
/// the rig stood before the run.
/// Source: E. H. Dowell et al., A Modern Course in Aeroelasticity (2015), chapter 11.
Effect freeplay() {
  Effect e;
  e.id = "freeplay";
  e.summary = "backlash, a gap in the torsional drive";
  e.equation = "M = -k (theta - clamp(theta, -delta, delta))";
  e.kind = "stiffness";
  e.source = "Dowell et al., A Modern Course in Aeroelasticity (2015), chapter 11";
  e.parameters = {{"half_gap", "rad", 0, 0, 0.5, false, "Record a pluck off the pitch axis or a rapid step, with torsion that crosses the gap."}};
  e.starts = {Eigen::VectorXd::Constant(1, 1e-3)};
  e.starts_for = [](const AeroelasticModel&, double widest) -> std::vector<Eigen::VectorXd> { return {Eigen::VectorXd::Constant(1, 0.05 * widest), Eigen::VectorXd::Constant(1, 0.3 * widest)}; };
  e.draw = [](const AeroelasticModel&, double, Effect::Random& random) { return log_between(random, {{3e-5, 3e-3}}); };
  e.acts = [](const Rig&, const Conditions&) { return true; };
  e.needs = Needs::beam;
  e.apply = [](LinearSystem& system, const EffectContext& c) {
    const Rig& rig = c.model.rig();
    const Basis& basis = c.model.basis();
    if (basis.torsion_modes < 1) return;
    const Eigen::Index first = basis.normal_modes, stiffness = c.model.index("torsion.stiffness_scale");
    const double shape = basis.twist(rig.submerged.back() - 1, first), omega = basis.omega[first];
    DualMatrix direction = port(system, c.ports.coordinate + first, c.theta[stiffness] * omega * omega / shape);
    direction.add_partial(stiffness, port(system, c.ports.coordinate + first, omega * omega / shape).value);
    Eigen::RowVectorXd twist = Eigen::RowVectorXd::Zero(system.coordinates);
    twist[first] = shape;
    append_feedback(system, direction, {displacement_of(system, twist), c.first_parameter, 1, of_one<gap>, of_one<rounded_gap>, steps});
  };
  return e;
}

}  // namespace unrig
