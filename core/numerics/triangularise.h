#pragma once
#include <Eigen/Core>

namespace unrig {

/// Reflects the rows such that the first `pivots` columns are upper triangular, in place; the other columns follow (Golub and Van Loan, Matrix Computations (2013), section 5.2).
/// For a matrix of some ten rows that is met at every sample; larger ones: Householder.
void triangularise(Eigen::Ref<Eigen::MatrixXd> rows, Eigen::Index pivots);

}  // namespace unrig
