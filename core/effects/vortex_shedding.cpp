#include <cmath>
#include <numbers>

#include "core/effects/list.h"

namespace unrig {

namespace {

constexpr double separated = 8 * std::numbers::pi / 180;  // incidence beyond which a section sheds a regular street

/// Frequency per Strouhal number: U / (c sin alpha).
double per_strouhal(const Conditions& c, double chord) { return c.speed / (chord * std::sin(std::abs(c.onset_angle))); }

}  // namespace

/// Vortex shedding of the stalled section: F(t) = a cos(2 pi f t) + b sin(2 pi f t) spread over the strips, f = St U / (c sin alpha), alpha the angle before the motion. The Strouhal
/// number St is shared; a and b [N] belong to each run. It needs flow and incidence.
/// Source: A. Fage and F. C. Johansen, Proc. R. Soc. London A 116 (1927) 170: f c sin(alpha)/U about 0.15 for inclined plates.
Effect vortex_shedding() {
  Effect e;
  e.id = "vortex-shedding";
  e.summary = "narrow-band force at a Strouhal frequency of flow speed and angle";
  e.equation = "F(t) = a cos 2 pi f t + b sin 2 pi f t on the strips, f = St U / (c sin alpha)";
  e.kind = "lift";
  e.source = "Fage and Johansen, Proc. R. Soc. London A 116 (1927) 170";
  e.parameters = {{"strouhal", "1", 0.17, 0.05, 0.6, false, "Record a longer run in the stream at more than 8 degrees."}};
  e.starts = {Eigen::VectorXd::Constant(1, 0.17)};
  e.frequency = [](const AeroelasticModel& model, const Conditions& c, const Eigen::VectorXd& p) { return p[0] * per_strouhal(c, 2 * model.rig().semichord()); };
  e.draw = [](const AeroelasticModel&, double, Effect::Random& random) { return log_between(random, {{0.12, 0.25}}); };
  e.states = [](const AeroelasticModel&, const Conditions&) -> Eigen::Index { return 2; };
  e.acts_in = "a run in a stream at more than 8 degrees before the motion";
  e.acts = [](const Rig&, const Conditions& c) { return c.speed > 0 && std::abs(c.onset_angle) > separated; };
  e.needs = Needs::beam;
  e.apply = [](LinearSystem& system, const EffectContext& c) {
    const double per_st = 2 * std::numbers::pi * per_strouhal(c.conditions, 2 * c.model.rig().semichord());
    const Eigen::Matrix2d turn = (Eigen::Matrix2d() << 0, 1, -1, 0).finished();
    DualMatrix F(c.parameter(0) * per_st * turn, c.theta.size());
    F.add_partial(c.first_parameter, per_st * turn);
    append_strip_signal(system, c, F, Eigen::RowVector2d(1, 0));
  };
  return e;
}

}  // namespace unrig
