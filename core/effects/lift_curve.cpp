#include <numbers>

#include "core/effects/list.h"

namespace unrig {

namespace {

/// -k a^3
double cube(double a, const double* p, double& slope, double* partial) {
  slope = -3 * p[0] * a * a;
  partial[0] = -a * a * a;
  return -p[0] * a * a * a;
}

}  // namespace

/// A lift curve that bends: with a_e the effective angle of attack at three-quarter chord, counted from that before the motion, the normal force on a strip of length l loses 2 pi k a_e^3 q c l at once, so that the slope falls
/// to s - 6 pi k a_e^2. k is shared by the runs.
/// Source: I. H. Abbott and A. E. von Doenhoff, Theory of Wing Sections (1959), chapter 7 (the slope falls towards maximum lift).
Effect lift_curve() {
  Effect e;
  e.id = "lift-curve";
  e.summary = "lift that bends away from a straight line as the angle grows";
  e.equation = "C_N = s a_e - 2 pi k a_e^3";
  e.kind = "lift";
  e.source = "Abbott and von Doenhoff, Theory of Wing Sections (1959), chapter 7";
  e.parameters = {{"cubic", "1", 0, -1e30, 1e30, false, "Record steps of several sizes."}};
  for (const double k : {5.0, 50.0, -20.0}) e.starts.push_back(Eigen::VectorXd::Constant(1, k));
  e.draw = [](const AeroelasticModel&, double, Effect::Random& random) -> Eigen::VectorXd { return Eigen::VectorXd::Constant(1, log_between(random, 1, 80)); };
  e.acts_in = "a run in a stream";
  e.acts = [](const Rig&, const Conditions& c) { return c.speed > 0; };
  e.in_the_load = true;
  e.needs = Needs::beam;
  e.apply = [](LinearSystem& system, const EffectContext& c) {
    const Rig& rig = c.model.rig();
    const double per_strip = 0.5 * c.conditions.density * c.conditions.speed * c.conditions.speed * rig.chord * rig.strip_length * 2 * std::numbers::pi;
    for (Eigen::Index s = 0; s < c.ports.strips; ++s)
      append_feedback(system, port(system, c.ports.strip + s, per_strip), {angle_of_attack(system, c.model, c.conditions.speed, s), c.first_parameter, 1, of_one<cube>});
  };
  return e;
}

}  // namespace unrig
