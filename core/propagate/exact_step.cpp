#include "core/propagate/exact_step.h"

#include <stdexcept>

#include <fmt/format.h>

namespace unrig {

ExactStep exact_step(const LinearSystem& system, double dt) {
  using Eigen::Index;
  const Index n = system.states(), m = system.B.cols(), jerk_columns = system.motion >= 0 ? 1 : 0, curved = system.curved, laws = static_cast<Index>(system.feedback.size());
  if (2 * curved > m) throw std::invalid_argument(fmt::format("{} inputs that are splines, and only {} columns for them and their second derivatives", curved, m));
  // z' = [x; jerk; u; slope of u per step; of the splines the second and third derivative; of the laws' forces the second]: the inputs as states of their own (Van Loan 1978).
  const Index first_input = n + jerk_columns, second = first_input + 2 * m, third = second + curved, bent = third + curved, size = bent + laws;
  DualMatrix augmented(Eigen::MatrixXd::Zero(size, size), system.A.parameters());
  augmented.set_block(0, 0, dt * system.A);
  if (jerk_columns) augmented.value(system.motion + 2, n) = dt;
  if (m > 0) {
    augmented.set_block(0, first_input, dt * system.B);
    augmented.value.block(first_input, first_input + m, m, m).setIdentity();
    augmented.value.block(first_input + m, second, curved, curved).setIdentity();
    augmented.value.block(second, third, curved, curved).setIdentity();
    augmented.value.block(second - laws, bent, laws, laws).setIdentity();
  }
  const DualMatrix e = exponential(augmented);
  ExactStep step;
  step.dt = dt;
  step.transition = e.block(0, 0, n, n);
  if (jerk_columns) step.jerk = e.block(0, n, n, 1);
  step.input1 = e.block(0, first_input + m, n, m);
  step.input0 = e.block(0, first_input, n, m) - step.input1;
  step.bend = 2.0 * e.block(0, bent, n, laws);
  if (curved > 0) {  // the spline's slope at the start of the step is u_{k+1} - u_k - dt^2/6 (2 u''_k + u''_{k+1}) per step
    const DualMatrix slope = e.block(0, first_input + m, n, curved), by_third = e.block(0, third, n, curved);
    step.input0.set_block(0, curved, dt * dt * (e.block(0, second, n, curved) - by_third - (1.0 / 3) * slope));
    step.input1.set_block(0, curved, dt * dt * (by_third - (1.0 / 6) * slope));
  }
  return step;
}

double input_between(const LinearSystem& system, const Eigen::MatrixXd& input, double dt, Eigen::Index sample, double s, Eigen::Index column) {
  const double straight = (1 - s) * input(sample, column) + s * input(sample + 1, column);
  if (column >= system.curved) return straight;
  const Eigen::Index curvature = system.curved + column;
  const double r = 1 - s;
  return straight + dt * dt / 6 * ((r * r * r - r) * input(sample, curvature) + (s * s * s - s) * input(sample + 1, curvature));
}

}  // namespace unrig
