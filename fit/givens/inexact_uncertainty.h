#pragma once
#include <Eigen/Core>
#include <vector>

#include "fit/likelihood/joint_problem.h"
#include "fit/givens/stated_numbers.h"
#include "fit/uncertainty/uncertainty.h"

namespace unrig {

/// What the runs say of the unknowns that are not held and, behind them, of the deviations of stated numbers: slopes^T slopes, and slopes^T residual.
struct JointInformation {
  std::vector<Eigen::Index> free;
  Eigen::MatrixXd of_data;
  Eigen::VectorXd downhill;
};
JointInformation joint_information(const JointProblem& joint, const NumberSlopes& slopes);
/// What they say of so many deviations with the unknowns eliminated.
Eigen::MatrixXd told_of_deviations(const JointInformation& information, Eigen::Index deviations);

/// Of unknowns and offsets, and of the deviations of stated numbers beside them.
struct InexactUncertainty {
  ParameterUncertainty parameters;
  Eigen::MatrixXd with_deviations;  ///< covariance of all rows of the matrices of `parameters` with the deviations
  Eigen::MatrixXd of_deviations;    ///< and of these
};

/// At the present values, which should be those of a finished fit, of a rig or of runs that state uncertainties. Both covariances of the parameters allow for them:
///
///   cov = H^-1 (C + I) H^-1,   H = J^T J + I over unknowns and deviations, I for the deviations only,
///
/// with C = J^T J times the reduced chi-square where that exceeds one, or J^T Sigma J (fit/uncertainty/coloured_noise.h). `numbers` null: none are stated.
InexactUncertainty inexact_uncertainty(const JointProblem& joint, const NumberSlopes* numbers);

}  // namespace unrig
