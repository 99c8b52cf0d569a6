#pragma once
#include <Eigen/Core>

#include "core/model/aeroelastic_model.h"
#include "core/numerics/dual_matrix.h"

namespace unrig {

/// One sample step of a linear system, without discretisation error:
///
///   x_{k+1} = transition x_k + jerk j_k + input0 u_k + input1 u_{k+1}
///
/// exact for a jerk that is constant over the step (cubic-spline motion), inputs that are linear over it (first-order hold), and those that are cubic splines:
///
///   u(s) = (1 - s) u_k + s u_{k+1} + dt^2/6 ((1 - s)^3 - (1 - s)) u''_k + dt^2/6 (s^3 - s) u''_{k+1},   s = (t - t_k)/dt in [0, 1]
///
/// whose second derivatives are inputs of their own (LinearSystem::curved). `bend` is the response to a law's force that goes as s^2 (core/propagate/step_matrices.h). All are blocks of one
/// matrix exponential, and carry exact partial derivatives.
/// Throws std::invalid_argument where there is no room for these.
struct ExactStep {
  double dt = 0;
  DualMatrix transition;  ///< n x n
  DualMatrix jerk;        ///< n x 1; empty where the system has no prescribed motion
  DualMatrix input0;      ///< n x m
  DualMatrix input1;      ///< n x m
  DualMatrix bend;        ///< n x feedbacks
};

ExactStep exact_step(const LinearSystem& system, double dt);

/// Input `column` a share s in [0, 1] of the way from a sample to the next one: straight, or along its spline. `input`: one row per sample, `dt` [s] between them.
double input_between(const LinearSystem& system, const Eigen::MatrixXd& input, double dt, Eigen::Index sample, double s, Eigen::Index column);

}  // namespace unrig
