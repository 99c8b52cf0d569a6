#include "core/effects/list.h"

namespace unrig {

/// Circulation that builds up differently from Wagner's function (finite span, free surface): phi(s) = 1 - a sum_k A_k exp(-r b_k s), A_k and b_k those of the model's
/// circulation; r stretches time, a the part of the lift that comes late. a = r = 1 is the model's own.
/// Source: R. T. Jones, NACA Report 681 (1940): on wings of finite span the lift starts higher and settles sooner, exponentials again.
Effect wagner_lag() {
  Effect e;
  e.id = "wagner-lag";
  e.summary = "circulation that builds up differently from Wagner's function";
  e.equation = "phi(s) = 1 - a sum_k A_k exp(-r b_k s)";
  e.kind = "lift";
  e.source = "R. T. Jones, NACA Report 681 (1940)";
  e.parameters = {{"rate", "1", 1, 0.05, 20, false, "Record a faster step of the angle."}, {"amplitude", "1", 1, 0, 1.9, false, "Record a faster step of the angle."}};
  e.starts = {Eigen::Vector2d(1, 1), Eigen::Vector2d(0.4, 1), Eigen::Vector2d(2.5, 1)};
  e.draw = [](const AeroelasticModel&, double, Effect::Random& random) { return log_between(random, {{0.25, 0.9}, {1, 1}}); };
  e.acts_in = "a run in a stream";
  e.acts = [](const Rig&, const Conditions& c) { return c.speed > 0; };
  e.in_the_load = true;
  e.needs = Needs::beam;
  e.apply = [](LinearSystem& system, const EffectContext& c) {
    const Eigen::Index n = system.states(), first = 2 * system.coordinates, terms = c.model.circulation().rate.size(), parameters = c.theta.size();
    if (system.lags == 0 || terms == 0) return;
    const Eigen::Index strips = system.lags / terms;
    const double r = c.parameter(0), a = c.parameter(1), per_time = c.conditions.speed / c.model.rig().semichord();
    // What is still missing of the downwash, y - w, stands in the lags' own rows: y' = -rate (y - w).
    for (DualMatrix* m : {&system.A, &system.C}) {
      DualMatrix late(Eigen::MatrixXd::Zero(m->rows(), n), parameters), late_inputs(Eigen::MatrixXd::Zero(m->rows(), system.B.cols()), parameters);
      for (Eigen::Index k = 0; k < terms; ++k) {
        const Eigen::Index at = first + k * strips;
        const double scale = -1 / (c.model.circulation().rate[k] * per_time);
        DualMatrix push = m->block(0, at, m->rows(), strips);
        if (m == &system.A) {  // the force of the lags, not their own decay
          push.value.middleRows(first, system.lags).setZero();
          for (Eigen::MatrixXd& p : push.partial)
            if (p.size() > 0) p.middleRows(first, system.lags).setZero();
        }
        late = late + push * (scale * system.A.block(at, 0, strips, n));
        late_inputs = late_inputs + push * (scale * system.B.block(at, 0, strips, system.B.cols()));
      }
      const auto grown = [&](const DualMatrix& whole, const DualMatrix& part) {
        DualMatrix sum = whole + (a - 1) * part;
        sum.partial.resize(static_cast<std::size_t>(parameters));
        sum.add_partial(c.first_parameter + 1, part.value);
        return sum;
      };
      DualMatrix& inputs = m == &system.A ? system.B : system.D;
      const DualMatrix with_inputs = grown(inputs, late_inputs);
      *m = grown(*m, late);
      inputs = with_inputs;
    }
    for (DualMatrix* m : {&system.A, &system.B}) {
      const Eigen::MatrixXd own = m->value.middleRows(first, system.lags);
      m->value.middleRows(first, system.lags) *= r;
      for (Eigen::MatrixXd& p : m->partial)
        if (p.size() > 0) p.middleRows(first, system.lags) *= r;
      Eigen::MatrixXd change = Eigen::MatrixXd::Zero(m->rows(), m->cols());
      change.middleRows(first, system.lags) = own;
      m->add_partial(c.first_parameter, change);
    }
  };
  return e;
}

}  // namespace unrig
