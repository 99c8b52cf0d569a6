#include "core/propagate/step_matrices.h"

#include <utility>

#include "core/numerics/small_product.h"

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;

/// What follows from v and from the forces in the middle and at the end.
struct Follows {
  DualMatrix early, late;
};

/// The measured inputs in the middle, from [u now; u next].
MatrixXd inputs_in_the_middle(const LinearSystem& system, Index measured, double dt) {
  MatrixXd middle(measured, 2 * measured);
  middle << MatrixXd::Identity(measured, measured) / 2, MatrixXd::Identity(measured, measured) / 2;
  for (Index i = 0; i < system.curved; ++i)
    for (const Index end : {Index{0}, measured}) middle(i, end + system.curved + i) = -dt * dt / 16;
  return middle;
}

/// The response of half a step to forces a + b s + c s^2, s from 0 to 1.
DualMatrix to_parabola(const ExactStep& half, double a, double b, double c) {
  const Index n = half.transition.rows(), laws = half.bend.cols(), first = half.input1.cols() - laws;
  const DualMatrix end = half.input1.block(0, first, n, laws);
  return a * (half.input0.block(0, first, n, laws) + end) + b * end + c * half.bend;
}

ExactStep without_partials(ExactStep step) {
  for (DualMatrix* m : {&step.transition, &step.jerk, &step.input0, &step.input1, &step.bend}) m->partial.clear();
  return step;
}

}  // namespace

StepMatrices::StepMatrices(const LinearSystem& system, const ExactStep& with_partials, const Arguments& seen, Index parameter_count)
    : states(system.states()), feedbacks(static_cast<Index>(system.feedback.size())), arguments(seen.count()), channels(system.C.rows()), measured(system.B.cols() - feedbacks), parameters(parameter_count) {
  const Index n = states, m = feedbacks, q = measured, columns = input() + 2 * q;
  const ExactStep half = parameters > 0 ? with_partials : without_partials(with_partials);
  const MatrixXd between = inputs_in_the_middle(system, q, 2 * half.dt), now = between.leftCols(q), next = between.rightCols(q);
  const DualMatrix from0 = half.input0.block(0, 0, n, q), from1 = half.input1.block(0, 0, n, q);

  // Either half from where it begins: early its inputs and the force at the beginning of the step, late the forces in the middle and at the end.
  const auto half_step = [&](const DualMatrix& force, const DualMatrix& inputs_now, const DualMatrix& inputs_next, const DualMatrix& in_the_middle, const DualMatrix& at_the_end) {
    Follows x{DualMatrix(MatrixXd::Zero(n, columns), parameters), DualMatrix(MatrixXd::Zero(n, forces()), parameters)};
    x.early.set_block(0, this->force(), force);
    if (half.jerk.value.size() > 0) x.early.set_block(0, jerk(), half.jerk);
    x.early.set_block(0, input(), inputs_now);
    x.early.set_block(0, input() + q, inputs_next);
    x.late.set_block(0, 0, in_the_middle);
    x.late.set_block(0, m, at_the_end);
    return x;
  };
  // The parabola through the three values as it runs over each half.
  const auto parabola = [&](double a, double b, double c) { return to_parabola(half, a, b, c); };
  Follows middle = half_step(parabola(1, -1.5, 0.5), from0 + from1 * DualMatrix(now), from1 * DualMatrix(next), parabola(0, 2, -1), parabola(0, -0.5, 0.5));
  middle.early.set_block(0, 0, half.transition);
  const Follows second = half_step(parabola(0, -0.5, 0.5), from0 * DualMatrix(now), from0 * DualMatrix(next) + from1, parabola(1, 0, -1), parabola(0, 0.5, 0.5));
  const Follows end{half.transition * middle.early + second.early, half.transition * middle.late + second.late};

  Follows all{DualMatrix(MatrixXd::Zero(padded_rows(n + this->seen() + channels), columns), parameters), {}};
  all.late = DualMatrix(MatrixXd::Zero(all.early.rows(), forces()), parameters);
  all.early.set_block(0, 0, end.early);
  all.late.set_block(0, 0, end.late);
  const auto stripped = [&](const DualMatrix& d) { return parameters > 0 ? d : DualMatrix(d.value); };
  const DualMatrix sees = stripped(seen.sees), sees_measured = stripped(seen.sees_input.block(0, 0, arguments, q)), sees_forces = stripped(seen.sees_input.block(0, q, arguments, m));
  const auto look = [&](const Follows& state, Index node, const MatrixXd& inputs) {
    Follows z{sees * state.early, sees * state.late};
    DualMatrix of_inputs(MatrixXd::Zero(arguments, columns), parameters), of_forces(MatrixXd::Zero(arguments, forces()), parameters);
    of_inputs.set_block(0, input(), sees_measured * DualMatrix(inputs));
    of_forces.set_block(0, node * m, sees_forces);
    all.early.set_block(argument() + node * arguments, 0, z.early + of_inputs);
    all.late.set_block(argument() + node * arguments, 0, z.late + of_forces);
  };
  MatrixXd at_end = MatrixXd::Zero(q, 2 * q);
  at_end.rightCols(q).setIdentity();
  look(middle, 0, between);
  look(end, 1, at_end);
  all.early.set_block(output(), 0, stripped(system.C));
  all.early.set_block(output(), this->force(), stripped(system.D.block(0, q, channels, m)));
  all.early.set_block(output(), input(), stripped(system.D.block(0, 0, channels, q)));

  for (Index j = 0; j < parameters; ++j) {
    const bool acts_early = all.early.depends_on(j) && !all.early.d(j).isZero(0), acts_late = all.late.depends_on(j) && !all.late.d(j).isZero(0);
    if (!acts_early && !acts_late) continue;
    partials.push_back({j, MatrixXd::Zero(all.early.rows(), columns + forces())});
    if (acts_early) partials.back().both.leftCols(columns) = all.early.d(j);
    if (acts_late) partials.back().both.rightCols(forces()) = all.late.d(j);
  }
  step = std::move(all.early.value);
  late = std::move(all.late.value);
}

}  // namespace unrig
