#include "core/effects/list.h"

namespace unrig {

namespace {

constexpr const char* steps = "Record faster steps of the angle, and let them run for some ten semichords.";

/// What is still missing of the downwash, lag - w, of the lags that begin at a state.
OnStrips missing(const OnStrips& w, Eigen::Index lag) {
  OnStrips m{-1.0 * w.of_states, -1.0 * w.of_inputs};
  m.of_states.value.middleCols(lag, m.of_states.rows()) += Eigen::MatrixXd::Identity(m.of_states.rows(), m.of_states.rows());
  return m;
}

}  // namespace

/// Circulation that builds up differently from Wagner's function (finite span, free surface): the share w of it replaced by two exponentials of their own,
///
///   phi(s) = 1 - (1 - w) sum_k A_k exp(-b_k s) - a_1 exp(-r_1 s) - a_2 exp(-r_2 s)
///
/// A_k and b_k [1/semichord] those of the model's circulation. w = a_1 = a_2 = 0 is the model's own; w = 1 leaves nothing of it. No amplitude a is negative: lift that comes and is lost again is
/// separation's (core/effects/separation_lag.cpp). Shared by all runs in a stream.
/// Source: R. T. Jones, NACA Report 681 (1940): on wings of finite span the lift starts higher and settles sooner, exponentials of other amplitudes and rates.
Effect wagner_lag() {
  Effect e;
  e.id = "wagner-lag";
  e.summary = "circulation that builds up differently from Wagner's function";
  e.equation = "phi(s) = 1 - (1 - w) sum_k A_k exp(-b_k s) - a_1 exp(-r_1 s) - a_2 exp(-r_2 s)";
  e.kind = "lift";
  e.source = "R. T. Jones, NACA Report 681 (1940)";
  e.parameters = {{"replaced_share", "1", 0, -0.9, 2, false, steps},
                  {"amplitude_1", "1", 0, 0, 2, false, steps},
                  {"rate_1", "1", 0.1, 0.01, 10, false, steps},
                  {"amplitude_2", "1", 0, 0, 2, false, steps},
                  {"rate_2", "1", 0.6, 0.01, 10, false, steps}};
  e.terms = {{1, 2}, {3, 4}};
  // All replaced: from a small share the search loses a term to an amplitude of zero, and from there it does not come back.
  const auto start = [&](double a1, double r1, double a2, double r2) { e.starts.push_back((Eigen::VectorXd(5) << 1, a1, r1, a2, r2).finished()); };
  start(0.165, 0.0455, 0.335, 0.3);  // Jones' exponentials for the function itself
  start(0.17, 0.02, 0.33, 0.12);     // which comes later
  for (const double a1 : {0.1, 0.25})
    for (const double a2 : {0.1, 0.25}) start(a1, 0.09, a2, 0.55);
  e.draw = [](const AeroelasticModel&, double, Effect::Random& random) {
    Eigen::VectorXd p = log_between(random, {{0.03, 1}, {0.05, 0.3}, {0.05, 0.15}, {0.05, 0.3}, {0.3, 0.9}});
    p[1] *= p[0];
    p[3] *= p[0];
    return p;
  };
  e.states = [](const AeroelasticModel& model, const Conditions&) -> Eigen::Index { return model.circulation().rate.size() > 0 ? 2 * static_cast<Eigen::Index>(model.rig().submerged.size()) : 0; };
  e.acts_in = "a run in a stream";
  e.acts = [](const Rig&, const Conditions& c) { return c.speed > 0; };
  e.in_the_load = true;
  e.needs = Needs::beam;
  e.apply = [](LinearSystem& system, const EffectContext& c) {
    if (system.lags == 0) return;
    const Eigen::Index terms = c.model.circulation().rate.size(), strips = c.ports.strips, first = 2 * system.coordinates;
    const Eigen::Index own[] = {append_lag(system, c, c.on_strips(2, c.parameter(2), 1)), append_lag(system, c, c.on_strips(4, c.parameter(4), 1))};
    const OnStrips w = downwash(system, c);
    OnStrips wagner{DualMatrix(Eigen::MatrixXd::Zero(strips, system.states()), c.theta.size()), DualMatrix(Eigen::MatrixXd::Zero(strips, system.B.cols()), c.theta.size())};
    for (Eigen::Index k = 0; k < terms; ++k) {
      const OnStrips late = missing(w, first + k * strips);
      const double amplitude = c.model.circulation_amplitude(c.theta, k);
      OnStrips part{amplitude * late.of_states, amplitude * late.of_inputs};
      if (const Eigen::Index parameter = c.model.circulation_parameter(k); parameter >= 0) {
        part.of_states.add_partial(parameter, late.of_states.value);
        part.of_inputs.add_partial(parameter, late.of_inputs.value);
      }
      wagner = {wagner.of_states + part.of_states, wagner.of_inputs + part.of_inputs};
    }
    const DualMatrix less = c.on_strips(0, -c.parameter(0), -1);
    OnStrips change{less * wagner.of_states, less * wagner.of_inputs};
    for (const Eigen::Index i : {0, 1}) {
      const DualMatrix amplitude = c.on_strips(1 + 2 * i, c.parameter(1 + 2 * i), 1);
      const OnStrips late = missing(w, own[i]);
      change = {change.of_states + amplitude * late.of_states, change.of_inputs + amplitude * late.of_inputs};
    }
    add_circulation(system, c, change);
  };
  return e;
}

}  // namespace unrig
