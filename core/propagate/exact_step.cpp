#include "core/propagate/exact_step.h"

namespace unrig {

ExactStep exact_step(const LinearSystem& system, double dt) {
  using Eigen::Index;
  const Index n = system.states(), m = system.B.cols(), jerk_columns = system.motion >= 0 ? 1 : 0;
  // z' = [x; jerk; u; slope of u per step]: the inputs as states of their own (Van Loan 1978).
  const Index size = n + jerk_columns + 2 * m, first_input = n + jerk_columns;
  DualMatrix augmented(Eigen::MatrixXd::Zero(size, size), system.A.parameters());
  augmented.set_block(0, 0, dt * system.A);
  if (jerk_columns) augmented.value(system.motion + 2, n) = dt;
  if (m > 0) {
    augmented.set_block(0, first_input, dt * system.B);
    augmented.value.block(first_input, first_input + m, m, m).setIdentity();
  }
  const DualMatrix e = exponential(augmented);
  ExactStep step;
  step.dt = dt;
  step.transition = e.block(0, 0, n, n);
  if (jerk_columns) step.jerk = e.block(0, n, n, 1);
  step.input1 = e.block(0, first_input + m, n, m);
  step.input0 = e.block(0, first_input, n, m) - step.input1;
  return step;
}

}  // namespace unrig
