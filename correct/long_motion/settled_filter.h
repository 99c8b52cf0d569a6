#pragma once
#include <Eigen/Core>

namespace unrig {

/// A linear system that noise drives, looked at with noise, for so long that its Kalman filter has settled:
///
///   x_(k+1) = F x_k + b w_k,   y_k = C x_k + v_k,   w white of variance 1, v white of variances r
///
/// P is the covariance of x_k for given y_0 .. y_(k-1), the solution of P = F P F' - K S K' + b b' with S = C P C' + diag r and K = F P C' S^-1; then
///
///   x_(k+1) = L x_k + K y_k,   L = F - K C,   innovations e_k = S^(-1/2) (y_k - C x_k), white of variance 1.
struct SettledFilter {
  Eigen::MatrixXd F, C;
  Eigen::VectorXd b, r;
  Eigen::MatrixXd P, K, L;
  Eigen::MatrixXd whiten;  ///< S^(-1/2), lower triangular
  double log_determinant = 0;  ///< of S
};

/// P by doubling (E. K.-W. Chu, H.-Y. Fan, W.-W. Lin and C.-S. Wang, Int. J. Control 77 (2004) 767, algorithm SDA): after k rounds of 6 n^3 it has seen 2^k samples. In units of each
/// state's own uncertainty, which a few samples tell.
/// Throws NoAnswer where no P settles: a state that runs away unseen.
SettledFilter settle(const Eigen::MatrixXd& F, const Eigen::VectorXd& b, const Eigen::MatrixXd& C, const Eigen::VectorXd& r);

}  // namespace unrig
