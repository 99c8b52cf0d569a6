#pragma once
#include <Eigen/Core>
#include <vector>

#include "core/propagate/exact_step.h"
#include "core/propagate/feedback_force.h"

namespace unrig {

/// All that one step of a system with feedback does linearly, as one matrix from v = [x; f; jerk; u now; u next] to [x at the end; what the laws see in the middle and at the end, both without the
/// forces there; outputs now]. A force is the parabola through its values at the beginning f, in the middle and at the end of the step (Lobatto IIIA, Hairer and Wanner 1996, IV.5), so that both
/// halves are exact steps (exact_step), from one to the other. The rows are padded for small_product.
struct StepMatrices {
  static constexpr Eigen::Index nodes = 2;  ///< of a step whose forces are solved for: its middle and its end
  Eigen::Index states, feedbacks, arguments, channels, measured, parameters;
  Eigen::MatrixXd step;     ///< rows x inputs
  Eigen::MatrixXd late;     ///< rows x nodes feedbacks: what the forces in the middle and at the end of the step add
  /// Of a parameter on which the two depend: [d step | d late].
  struct Partial {
    Eigen::Index parameter;
    Eigen::MatrixXd both;
  };
  std::vector<Partial> partials;

  Eigen::Index rows() const { return step.rows(); }
  Eigen::Index inputs() const { return step.cols(); }
  Eigen::Index forces() const { return nodes * feedbacks; }
  Eigen::Index seen() const { return nodes * arguments; }
  // Where each part of v begins, behind x.
  Eigen::Index force() const { return states; }
  Eigen::Index jerk() const { return states + feedbacks; }
  Eigen::Index input() const { return jerk() + 1; }
  // Where each part of a row begins, behind x.
  Eigen::Index argument() const { return states; }
  Eigen::Index output() const { return states + seen(); }

  /// `half`: the exact half of the step. `parameters`: P, of which it, `system` and `seen` carry partials; 0 for none.
  StepMatrices(const LinearSystem& system, const ExactStep& half, const Arguments& seen, Eigen::Index parameters);
};

}  // namespace unrig
