#pragma once
#include <Eigen/Core>
#include <functional>
#include <string>

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

/// What a disturbance of the readings does to the estimates of a run: columns over (theta, c) whose products with themselves sum to the covariance that it adds. The motion of the shaft follows theta.
///
///   D D' = sum_f w_f S(f) / N(f) u(f) u(f)^*,
///
/// u(f) the transform of what each whitened reading does to (theta, c), N the density of the noise that whitening made 1, w_f the lines that f stands for: the usual estimate's variance with other errors than it
/// was made for (G. A. F. Seber and C. J. Wild, Nonlinear Regression (1989), section 6.2). `density`: S of a channel beyond white noise, one-sided [square of its unit per Hz]; what the channel's own colour
/// counts already is taken off. `root`: C = root root', C the covariance of theta.
Eigen::MatrixXd disturbance_root(const RunResidual& residual, const RunResidual::Sensitivity& sensitivity, const RunResidual::Evaluation& e, const Eigen::MatrixXd& root,
                                 const std::function<double(const std::string& channel, double frequency)>& density);

}  // namespace unrig
