#pragma once
#include <Eigen/Core>

namespace unrig {

/// A = Q R by Householder's reflections (Golub and Van Loan, Matrix Computations (2013), section 5.2), where most of the time of a fit goes: done in the widest vectors that the processor it
/// runs on has, whatever the library is compiled for. Q is rows x rows, R min(rows, columns) x columns.
class Householder {
 public:
  Householder() = default;
  explicit Householder(Eigen::MatrixXd a);

  Eigen::Index rows() const { return factors_.rows(); }
  Eigen::Index cols() const { return factors_.cols(); }
  /// R on and above the diagonal, the reflections' vectors below it.
  const Eigen::MatrixXd& factors() const { return factors_; }
  /// R.
  Eigen::MatrixXd triangle() const;
  /// Q^T b; b has as many rows as A.
  Eigen::MatrixXd rotated(Eigen::MatrixXd b) const;

 private:
  Eigen::MatrixXd factors_;
  Eigen::VectorXd coefficients_;
};

}  // namespace unrig
