#include "core/propagate/step_matrices.h"

#include "core/numerics/small_product.h"

namespace unrig {

using Eigen::Index;
using Eigen::MatrixXd;

/// What the laws see of inputs and forces at the end of the step.
void StepMatrices::see(const MatrixXd& sees_input, MatrixXd& all, MatrixXd& at_end) const {
  all.block(argument(), input() + measured, arguments, measured) += sees_input.leftCols(measured);
  at_end.middleRows(argument(), arguments) += sees_input.rightCols(feedbacks);
}

template <typename Part>
void StepMatrices::fill(const LinearSystem& system, const ExactStep& exact, const MatrixXd& sees, Part part, MatrixXd& all, MatrixXd& at_end) const {
  all = MatrixXd::Zero(padded_rows(states + arguments + channels), states + feedbacks + 1 + 2 * measured);
  at_end = MatrixXd::Zero(all.rows(), feedbacks);
  if (const MatrixXd* m = part(exact.transition)) all.topLeftCorner(states, states) = *m;
  if (const MatrixXd* m = part(exact.input0)) {
    all.block(0, force(), states, feedbacks) = m->rightCols(feedbacks);
    all.block(0, input(), states, measured) = m->leftCols(measured);
  }
  if (const MatrixXd* m = part(exact.input1)) {
    at_end.topRows(states) = m->rightCols(feedbacks);
    all.block(0, input() + measured, states, measured) = m->leftCols(measured);
  }
  if (exact.jerk.value.size() > 0)
    if (const MatrixXd* m = part(exact.jerk)) all.col(jerk()).head(states) = m->col(0);
  all.middleRows(argument(), arguments) = sees * all.topRows(states);
  at_end.middleRows(argument(), arguments) = sees * at_end.topRows(states);
  if (const MatrixXd* m = part(system.C)) all.block(output(), 0, channels, states) = *m;
  if (const MatrixXd* m = part(system.D)) {
    all.block(output(), force(), channels, feedbacks) = m->rightCols(feedbacks);
    all.block(output(), input(), channels, measured) = m->leftCols(measured);
  }
}

StepMatrices::StepMatrices(const LinearSystem& system, const ExactStep& exact, const Arguments& seen, Index parameter_count)
    : states(system.states()), feedbacks(static_cast<Index>(system.feedback.size())), arguments(seen.count()), channels(system.C.rows()), measured(system.B.cols() - feedbacks), parameters(parameter_count) {
  const auto value = [](const DualMatrix& m) { return &m.value; };
  fill(system, exact, seen.sees.value, value, step, late);
  see(seen.sees_input.value, step, late);
  MatrixXd d_step, d_late;
  for (Index j = 0; j < parameters; ++j) {
    fill(system, exact, seen.sees.value, [j](const DualMatrix& m) { return m.depends_on(j) ? &m.d(j) : nullptr; }, d_step, d_late);
    if (seen.sees.depends_on(j)) {
      d_step.middleRows(argument(), arguments) += seen.sees.d(j) * step.topRows(states);
      d_late.middleRows(argument(), arguments) += seen.sees.d(j) * late.topRows(states);
    }
    if (seen.sees_input.depends_on(j)) see(seen.sees_input.d(j), d_step, d_late);
    if (d_step.isZero(0) && d_late.isZero(0)) continue;
    partials.push_back({j, MatrixXd(rows(), inputs() + feedbacks)});
    partials.back().both << d_step, d_late;
  }
}

}  // namespace unrig
