#pragma once
#include <Eigen/Core>

#include "core/model/aeroelastic_model.h"

namespace unrig {

/// Several quantities as functions of the time t [s] after an ideal step, each a sum of exponentials and of what happens at the step
/// itself:
///
///   y(t) = steady + Re sum_k residue_k exp(pole_k t)   (t > 0),   and at t = 0:   impulse delta(t) + doublet delta'(t)
///
/// Its Laplace transform is steady/s + sum_k residue_k/(s - pole_k) + impulse + doublet s: the partial fractions of the seed's Appendix C.
struct PoleExpansion {
  Eigen::VectorXd steady;
  Eigen::MatrixXcd residue;  ///< quantities x poles
  Eigen::VectorXd impulse;   ///< per second
  Eigen::VectorXd doublet;   ///< per second squared
};

/// The coupled rig's answer to an instantaneous step of the shaft (seed, Eq. 3.18-3.20): p = step, p' = delta, p'' = delta'.
struct IdealStep {
  Eigen::VectorXcd pole;  ///< 1/s; complex ones in conjugate pairs
  PoleExpansion state;    ///< the states of the system but those of the pitch, in their order
  PoleExpansion output;   ///< its outputs
  Eigen::VectorXd start;  ///< those states just after the step, without their delta functions

  /// The smooth part at t > 0; at t = 0 its limit from the right.
  Eigen::VectorXd output_at(double t) const;
  Eigen::VectorXd state_at(double t) const;
};

/// What a unit step of the shaft does to the states of `system` in no time, p itself included: with x' = A x + A_p p + A_r p' + A_a p'' the
/// part A_a p'' = A_a delta' leaves A_a delta in x, and this drives x once more, so that x jumps by A_r + A A_a. (A shaft that turns at
/// once leaves the rigid part of the rig behind: the twist jumps by nearly minus the step.)
Eigen::VectorXd step_jump(const LinearSystem& system);

/// The response to a step of `amplitude` [rad] from rest, in closed form: poles are the eigenvalues of A, residues come from its
/// eigenvectors.
///
/// Throws std::invalid_argument where the system has no prescribed pitch, and where its eigenvectors do not span the states (a pole that
/// is multiple without as many eigenvectors has no partial fractions of this form).
IdealStep ideal_step(const LinearSystem& system, double amplitude);

}  // namespace unrig
