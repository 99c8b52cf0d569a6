#include <cmath>
#include <numbers>

#include "core/effects/list.h"

namespace unrig {

namespace {

using std::numbers::pi;

constexpr double separated = 8 * pi / 180;  // incidence beyond which a section sheds a regular street
constexpr const char* longer = "Record a longer run in the stream at more than 8 degrees.";

/// Frequency per Strouhal number: U / (c sin alpha).
double per_strouhal(const Conditions& c, double chord) { return c.speed / (chord * std::sin(std::abs(c.onset_angle))); }

}  // namespace

/// Vortex shedding of the stalled section: a force whose size and phase wander, spread evenly over the strips. F = z1 with
///
///   z' = [-beta w, w; -w, -beta w] z + kappa q S sqrt(w) e,   w = 2 pi f,   f = St U / (c sin alpha),
///
/// e two independent white noises of unit density, q S dynamic pressure times the wetted strips' area, alpha the angle before the motion. Its spectrum is a line at f with the half-width
/// beta f; once it has settled its root mean square is q S kappa / sqrt(2 beta). A phase that walks by D radians per root second has beta w = D^2 / 2. Where beta and kappa are 0 it is a steady
/// tone a cos(2 pi f t) + b sin(2 pi f t). St, beta and kappa are shared; the initial z [N] belongs to each run. It needs flow and incidence.
/// Source: A. Fage and F. C. Johansen, Proc. R. Soc. London A 116 (1927) 170: f c sin(alpha)/U about 0.15 for inclined plates; line of finite width: B. J. Vickery and R. I. Basu, J. Wind Eng. Ind.
/// Aerodyn. 12 (1983) 49.
Effect vortex_shedding() {
  Effect e;
  e.id = "vortex-shedding";
  e.summary = "narrow-band force at a Strouhal frequency of flow speed and angle";
  e.equation = "F = z1 on the strips, z' = [-beta w, w; -w, -beta w] z + kappa q S sqrt(w) white noise, w = 2 pi f, f = St U / (c sin alpha)";
  e.kind = "lift";
  e.source = "Fage and Johansen, Proc. R. Soc. London A 116 (1927) 170; Vickery and Basu, J. Wind Eng. Ind. Aerodyn. 12 (1983) 49";
  e.parameters = {{"strouhal", "1", 0.17, 0.05, 0.6, false, longer}, {"bandwidth", "1", 0.01, 0, 0.15, false, longer}, {"wander", "1", 0.003, 0, 1, false, longer}};
  e.starts = {Eigen::Vector3d(0.17, 0.01, 0.003)};
  e.frequency = [](const AeroelasticModel& model, const Conditions& c, const Eigen::VectorXd& p) { return p[0] * per_strouhal(c, 2 * model.rig().semichord()); };
  e.draw = [](const AeroelasticModel&, double, Effect::Random& random) -> Eigen::VectorXd { return Eigen::Vector3d(log_between(random, 0.12, 0.25), 0, 0); };
  e.states = [](const AeroelasticModel&, const Conditions&) -> Eigen::Index { return 2; };
  e.acts_in = "a run in a stream at more than 8 degrees before the motion";
  e.acts = [](const Rig&, const Conditions& c) { return c.speed > 0 && std::abs(c.onset_angle) > separated; };
  e.needs = Needs::beam;
  e.apply = [](LinearSystem& system, const EffectContext& c) {
    const double per_st = 2 * pi * per_strouhal(c.conditions, 2 * c.model.rig().semichord()), omega = c.parameter(0) * per_st, bandwidth = c.parameter(1);
    const Eigen::Matrix2d turn = (Eigen::Matrix2d() << 0, 1, -1, 0).finished(), unit = Eigen::Matrix2d::Identity();
    DualMatrix F(omega * (turn - bandwidth * unit), c.theta.size());
    F.add_partial(c.first_parameter, per_st * (turn - bandwidth * unit));
    F.add_partial(c.first_parameter + 1, -omega * unit);
    append_strip_signal(system, c, F, Eigen::RowVector2d(1, 0));
  };
  e.noise = [](const EffectContext& c) {
    const Rig& rig = c.model.rig();
    const double per_st = 2 * pi * per_strouhal(c.conditions, 2 * rig.semichord()), root = std::sqrt(c.parameter(0) * per_st);
    const double pressure = 0.5 * c.conditions.density * c.conditions.speed * c.conditions.speed, area = 2 * rig.semichord() * rig.strip_length * static_cast<double>(rig.submerged.size());
    const double per_kappa = pressure * area * root;
    const Eigen::Matrix2d unit = Eigen::Matrix2d::Identity();
    DualMatrix noise(c.parameter(2) * per_kappa * unit, c.theta.size());
    noise.add_partial(c.first_parameter, c.parameter(2) * per_kappa / (2 * c.parameter(0)) * unit);
    noise.add_partial(c.first_parameter + 2, per_kappa * unit);
    return noise;
  };
  return e;
}

}  // namespace unrig
