#pragma once
#include <Eigen/QR>
#include <vector>

#include "core/numerics/householder.h"

// Rows of a linear least-squares problem: stacked, compressed, solved. Their bodies are compiled once: in a header Eigen's decompositions cost each file that includes it seconds.

namespace unrig::run_rows {

/// The upper triangular (or trapezoidal) factor of `rows`: the same inner products in no more rows than columns.
Eigen::MatrixXd compress(Eigen::MatrixXd rows);

/// Blocks of so many columns, one below the other.
Eigen::MatrixXd stacked(const std::vector<Eigen::MatrixXd>& blocks, Eigen::Index columns);

/// Least squares by column-scaled QR. Columns that the rows do not determine (a state that no channel sees) are left at zero.
class Eliminator {
 public:
  explicit Eliminator(const Eigen::MatrixXd& columns);
  Eigen::Index rank() const { return deficient_ ? pivoted_.rank() : scale_.size(); }
  /// Coordinates of `rows` in the columns' space (the first `rank` rows) and beside it.
  Eigen::MatrixXd rotated(const Eigen::MatrixXd& rows) const;
  /// The columns themselves in these coordinates: rank x columns.
  Eigen::MatrixXd coordinates() const;
  /// Solution of R x = rotated, back in the columns' own scale.
  Eigen::MatrixXd solve(const Eigen::MatrixXd& rotated) const;
  /// Column j of (R^T R)^-1: how the unknowns move with the score of unknown j. Zero for one that the rows do not determine.
  Eigen::VectorXd covariance_column(Eigen::Index j) const;
  /// R with R^T R = the columns' information matrix. Only where all columns are determined is it regular.
  Eigen::MatrixXd factor() const;

 private:
  Eigen::VectorXd scale_;
  Householder quick_;
  Eigen::ColPivHouseholderQR<Eigen::MatrixXd> pivoted_;
  bool deficient_ = false;
};

}  // namespace unrig::run_rows
