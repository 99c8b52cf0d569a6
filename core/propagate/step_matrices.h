#pragma once
#include <Eigen/Core>
#include <vector>

#include "core/propagate/exact_step.h"
#include "core/propagate/feedback_force.h"

namespace unrig {

/// All that one step of a system with feedback does linearly, as one matrix from v = [x; f; jerk; u now; u next] to [x without the force at the end of the step; what the laws
/// see of that; outputs now]. The rows are padded for small_product.
struct StepMatrices {
  Eigen::Index states, feedbacks, arguments, channels, measured, parameters;
  Eigen::MatrixXd step;     ///< rows x inputs
  Eigen::MatrixXd late;     ///< rows x feedbacks: what the force at the end of the step adds
  /// Of a parameter on which the two depend: [d step | d late].
  struct Partial {
    Eigen::Index parameter;
    Eigen::MatrixXd both;
  };
  std::vector<Partial> partials;

  Eigen::Index rows() const { return step.rows(); }
  Eigen::Index inputs() const { return step.cols(); }
  // Where each part of v begins, behind x.
  Eigen::Index force() const { return states; }
  Eigen::Index jerk() const { return states + feedbacks; }
  Eigen::Index input() const { return jerk() + 1; }
  // Where each part of a row begins, behind x.
  Eigen::Index argument() const { return states; }
  Eigen::Index output() const { return states + arguments; }

  /// `parameters`: P, of which `exact` and `seen` carry partials; 0 for none.
  StepMatrices(const LinearSystem& system, const ExactStep& exact, const Arguments& seen, Eigen::Index parameters);

 private:
  void see(const Eigen::MatrixXd& sees_input, Eigen::MatrixXd& all, Eigen::MatrixXd& at_end) const;
  template <typename Part>
  void fill(const LinearSystem& system, const ExactStep& exact, const Eigen::MatrixXd& sees, Part part, Eigen::MatrixXd& all, Eigen::MatrixXd& at_end) const;
};

}  // namespace unrig
