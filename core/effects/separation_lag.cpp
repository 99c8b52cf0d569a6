#include "core/effects/list.h"

namespace unrig {

namespace {

constexpr const char* steps = "Record a step of the angle and let it run for some hundred semichords.";

}  // namespace

/// Slow loss of lift after a change of the angle, while the separation point moves forward along the suction side: of the circulatory force on a strip the
/// share D of what the downwash w would give in the end is lost with the time constant T_s in semichords, N -= s rho U b l D y, y' = (U / b T_s) (w - y), so that
/// phi(s) -> phi(s) - D (1 - exp(-s/T_s)). D and T_s are shared by all runs in a stream, at any angle.
/// Source: J. G. Leishman and T. S. Beddoes, J. American Helicopter Society 34(3) (1989) 3 (first-order lag of the trailing-edge separation point).
Effect separation_lag() {
  Effect e;
  e.id = "separation-lag";
  e.summary = "slow loss of lift after a step";
  e.equation = "phi(s) -> phi(s) - D (1 - exp(-s/T_s))";
  e.kind = "lift";
  e.source = "Leishman and Beddoes, J. American Helicopter Society 34(3) (1989) 3";
  e.parameters = {{"loss", "1", 0, -2, 2, false, steps}, {"time", "1", 10, 0.5, 300, false, steps}};
  for (const double s : {4.0, 10.0, 25.0}) e.starts.push_back(Eigen::Vector2d(0.1, s));
  e.draw = [](const AeroelasticModel&, double, Effect::Random& random) { return log_between(random, {{0.01, 0.4}, {4, 40}}); };
  e.states = [](const AeroelasticModel& model, const Conditions&) -> Eigen::Index { return model.circulation().rate.size() > 0 ? static_cast<Eigen::Index>(model.rig().submerged.size()) : 0; };
  e.acts_in = "a run in a stream";
  e.acts = [](const Rig&, const Conditions& c) { return c.speed > 0; };
  e.in_the_load = true;
  e.needs = Needs::beam;
  e.apply = [](LinearSystem& system, const EffectContext& c) {
    const Eigen::Index n = system.states(), first = 2 * system.coordinates, terms = c.model.circulation().rate.size(), parameters = c.theta.size(), inputs = system.B.cols();
    if (system.lags == 0 || terms == 0) return;
    const Eigen::Index strips = system.lags / terms;
    const Rig& rig = c.model.rig();
    const double b = rig.semichord(), per_time = c.conditions.speed / b, loss = c.parameter(0), time = c.parameter(1);
    // The downwash stands in the first lag's rows, y' = rate (w - y); what a strip's circulation does, in its columns, times its amplitude.
    const double rate = c.model.circulation().rate[0] * per_time, amplitude = c.model.circulation_amplitude(c.theta, 0);
    const DualMatrix w_states = (1 / rate) * system.A.block(first, 0, strips, n), w_inputs = (1 / rate) * system.B.block(first, 0, strips, inputs);
    DualMatrix downwash(Eigen::MatrixXd::Zero(strips, n), parameters);
    downwash.value = w_states.value;
    downwash.value.middleCols(first, strips) += Eigen::MatrixXd::Identity(strips, strips);
    DualMatrix push = (1 / amplitude) * system.A.block(0, first, n, strips), read = (1 / amplitude) * system.C.block(0, first, system.C.rows(), strips);
    push.value.middleRows(first, system.lags).setZero();
    for (Eigen::MatrixXd& p : push.partial)
      if (p.size() > 0) p.middleRows(first, system.lags).setZero();

    // States lag' = (per_time / T_s) (w - lag); force -D lag.
    const Eigen::Index total = n + strips;
    DualMatrix A(Eigen::MatrixXd::Zero(total, total), parameters), B(Eigen::MatrixXd::Zero(total, inputs), parameters), C(Eigen::MatrixXd::Zero(system.C.rows(), total), parameters);
    A.set_block(0, 0, system.A);
    B.set_block(0, 0, system.B);
    C.set_block(0, 0, system.C);
    const auto lose = [&](const DualMatrix& per_lag) {
      DualMatrix lost = (-loss) * per_lag;
      lost.partial.resize(static_cast<std::size_t>(parameters));
      lost.add_partial(c.first_parameter, -per_lag.value);
      return lost;
    };
    A.set_block(0, n, lose(push));
    C.set_block(0, n, lose(read));
    Eigen::MatrixXd own(strips, total);
    own << downwash.value, -Eigen::MatrixXd::Identity(strips, strips);
    const double lag_rate = per_time / time;
    DualMatrix rows(lag_rate * own, parameters);
    rows.add_partial(c.first_parameter + 1, -lag_rate / time * own);
    A.set_block(n, 0, rows);
    DualMatrix input_rows(lag_rate * w_inputs.value, parameters);
    input_rows.add_partial(c.first_parameter + 1, -lag_rate / time * w_inputs.value);
    B.set_block(n, 0, input_rows);
    system.A = A;
    system.B = B;
    system.C = C;
    for (Eigen::Index s = 0; s < strips; ++s) system.settling.push_back(n + s);
  };
  return e;
}

}  // namespace unrig
