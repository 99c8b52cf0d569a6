#pragma once
#include <Eigen/Core>
#include <vector>

namespace unrig {

/// A matrix and its exact partial derivatives with respect to the model's parameters theta_1..theta_P.
///
/// A partial that is identically zero is stored as an empty (0 x 0) matrix and costs nothing. All operations apply the product rule; nothing is
/// differenced. Shapes must agree as in Eigen; P is the same for all operands, or 0 for a constant.
struct DualMatrix {
  Eigen::MatrixXd value;
  std::vector<Eigen::MatrixXd> partial;

  DualMatrix() = default;
  explicit DualMatrix(Eigen::MatrixXd constant) : value(std::move(constant)) {}
  DualMatrix(Eigen::MatrixXd constant, Eigen::Index parameters) : value(std::move(constant)), partial(static_cast<std::size_t>(parameters)) {}

  Eigen::Index rows() const { return value.rows(); }
  Eigen::Index cols() const { return value.cols(); }
  Eigen::Index parameters() const { return static_cast<Eigen::Index>(partial.size()); }
  bool depends_on(Eigen::Index j) const { return j < parameters() && partial[static_cast<std::size_t>(j)].size() > 0; }
  const Eigen::MatrixXd& d(Eigen::Index j) const { return partial[static_cast<std::size_t>(j)]; }

  /// Adds `change` to the partial with respect to parameter j.
  void add_partial(Eigen::Index j, const Eigen::MatrixXd& change);
  /// The sub-block, with its partials.
  DualMatrix block(Eigen::Index row, Eigen::Index col, Eigen::Index rows, Eigen::Index cols) const;
  /// This in the top left of a larger matrix of zeros.
  DualMatrix grown(Eigen::Index rows, Eigen::Index cols) const;
  /// Writes `part` (and its partials) into the block at (row, col).
  void set_block(Eigen::Index row, Eigen::Index col, const DualMatrix& part);
  void set_block(Eigen::Index row, Eigen::Index col, const Eigen::MatrixXd& constant) { value.block(row, col, constant.rows(), constant.cols()) = constant; }
};

DualMatrix operator+(const DualMatrix& a, const DualMatrix& b);
DualMatrix operator-(const DualMatrix& a, const DualMatrix& b);
DualMatrix operator*(const DualMatrix& a, const DualMatrix& b);
DualMatrix operator*(double factor, const DualMatrix& a);
DualMatrix operator*(const Eigen::MatrixXd& constant, const DualMatrix& a);

/// X with A X = B; dX = A^-1 (dB - dA X).
DualMatrix solve(const DualMatrix& a, const DualMatrix& b);

/// exp(A), with its Frechet derivatives, by scaling and squaring of the Taylor polynomial of degree 12 after diagonal balancing.
/// Truncation: 0.25^13/13! = 2.4e-18 of the scaled matrix's exponential (scaled 1-norm at most 1/4), far below its round-off; s squarings
/// amplify both by at most 2^s.
DualMatrix exponential(const DualMatrix& a);

}  // namespace unrig
