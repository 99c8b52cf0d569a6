#pragma once
#include <Eigen/Core>
#include <vector>

#include "fit/likelihood/joint_problem.h"

namespace unrig {

/// Covariance of the unknowns of a joint fit that are not held, both ways; the matrices go on with the offset of the first channel of each run.
struct ParameterUncertainty {
  std::vector<Eigen::Index> free;        ///< which unknowns, in the order of the matrices
  Eigen::MatrixXd white_covariance;      ///< H^-1, times the reduced chi-square where that exceeds one
  Eigen::MatrixXd coloured_covariance;   ///< H^-1 (J^T Sigma J) H^-1 with the residuals' own spectra, and with what these leave open (fit/uncertainty/coloured_noise.h)
  Eigen::MatrixXd offset_slope;          ///< d offset / d unknown, of all unknowns, held ones too; a row per run
  bool coloured = false;                 ///< some run's residual is not white: its probability, times the number of runs, is below 1 %
  std::vector<double> whiteness;         ///< per run
  /// How far each unknown would move without the later halves of the runs, to first order: 2 G times slopes^T residual over the earlier halves, G as in fit/uncertainty/coloured_noise.h. A half holds half of
  /// what the run says of the unknown. Where what is left is noise, of whatever colour, this has the unknown's own variance.
  Eigen::VectorXd earlier_half;

  const Eigen::MatrixXd& with_offsets() const { return coloured ? coloured_covariance : white_covariance; }
  /// Of the unknowns alone.
  Eigen::MatrixXd covariance() const {
    const auto n = static_cast<Eigen::Index>(free.size());
    return with_offsets().topLeftCorner(n, n);
  }
};

/// At the present values, which should be those of a finished fit.
ParameterUncertainty estimate_uncertainty(const JointProblem& joint);

}  // namespace unrig
