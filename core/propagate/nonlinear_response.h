#pragma once
#include <Eigen/Core>
#include <vector>

#include "core/propagate/exact_step.h"
#include "core/propagate/response.h"

namespace unrig {

/// What drives a nonlinear system over a stretch of samples, and where it starts. Tangents are its derivatives along K chosen directions.
struct NonlinearDrive {
  Eigen::VectorXd start;          ///< n
  Eigen::VectorXd jerk;           ///< one per sample; empty: none
  Eigen::MatrixXd input;          ///< measured inputs, samples + 1 rows, in between as the system takes them (input_between); no columns: none
  Eigen::MatrixXd start_tangent;  ///< n x K
  Eigen::MatrixXd jerk_tangent;   ///< samples x K; empty: the directions do not touch the jerk
  Eigen::MatrixXd start_partial = {};  ///< n x P, of the start in theta; empty: none
};

/// Outputs of a linear system with feedback, its tangents, and the state behind the last sample.
struct NonlinearResponse {
  Eigen::MatrixXd output;                ///< samples x channels
  std::vector<Eigen::MatrixXd> tangent;  ///< per channel: samples x (K + P), P = 0 for Partials::none
  Eigen::VectorXd end;                   ///< n
  Eigen::MatrixXd end_tangent;           ///< n x (K + P)
  Eigen::VectorXd largest_argument;      ///< per feedback: largest |z| of its first argument
  bool finite = true;
};

/// The system without its laws and the inputs that these drive: what is left of B and D belongs to what was measured.
LinearSystem linear_part(LinearSystem system);

/// The system without partials and laws under one of its inputs alone, which runs straight between samples.
LinearSystem under_one_input(LinearSystem system, Eigen::Index input);

/// Half the step that `follow` takes: of a sample, or of as small a part of it as the most demanding of the system's feedbacks wants.
ExactStep step_to_follow(const LinearSystem& system, double dt);

/// Follows x' = A x + J jerk + B [u; f(S x)] in equal steps, `half` of each by step_to_follow. The linear part is exact. The nonlinear forces run as parabolas through the beginning, the middle
/// and the end of each step, so that a smooth force of angular frequency w is off by (w dt)^4/720 of itself, dt the step (Hairer and Wanner 1996, IV.5, Lobatto IIIA). The forces in the
/// middle and at the end are solved for together with the state, so that stiff and dissipative laws stay stable. Throws std::invalid_argument where the system has another number of
/// measured inputs. Tangents are exact derivatives of this recursion: K directions, and the partials in theta where asked.
NonlinearResponse follow(const LinearSystem& system, const ExactStep& half, const Eigen::VectorXd& theta, const NonlinearDrive& drive, Eigen::Index samples,
                         Partials partials);

}  // namespace unrig
