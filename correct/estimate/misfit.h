#pragma once
#include <Eigen/Core>

#include "fit/likelihood/run_residual.h"

namespace unrig {

/// By how much more the unexplained part of a run moves an answer than white noise of its size would: standard deviations, one over the other.
///
/// At the best theta the residuals' pulls J^T e sum to zero. Over blocks of a thirtieth of the record they are as large as white noise makes them, or larger where what is left goes on for
/// longer than a sample:
///
///   R^2 = sum_k sum_B (v_k' C J_B' e_B)^2 / (chi^2_red sum_k v_k' C (sum_B J_B' J_B) C v_k),
///
/// v_k the slopes of the answer in theta, C the covariance of theta. It is the ratio of the cluster-robust variance (K.-Y. Liang and S. L. Zeger, Biometrika 73 (1986) 13) to the usual one, pooled
/// over the answer, and known to a seventh. `root`: C = root root'; `answer_by_theta`: rows v_k, with the linear unknowns following theta.
double misfit_over_noise(const RunResidual::Sensitivity& sensitivity, const Eigen::MatrixXd& root, const Eigen::MatrixXd& answer_by_theta, double reduced_chi2);

}  // namespace unrig
