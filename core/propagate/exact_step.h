#pragma once
#include <Eigen/Core>

#include "core/model/aeroelastic_model.h"
#include "core/numerics/dual_matrix.h"

namespace unrig {

/// One sample step of a linear system, without discretisation error:
///
///   x_{k+1} = transition x_k + jerk j_k + input0 u_k + input1 u_{k+1}
///
/// exact for a jerk that is constant over the step (cubic-spline motion) and inputs that are linear over it (first-order hold). All four are
/// blocks of one matrix exponential, and carry exact partial derivatives.
struct ExactStep {
  double dt = 0;
  DualMatrix transition;  ///< n x n
  DualMatrix jerk;        ///< n x 1; empty where the system has no prescribed motion
  DualMatrix input0;      ///< n x m
  DualMatrix input1;      ///< n x m
};

ExactStep exact_step(const LinearSystem& system, double dt);

}  // namespace unrig
