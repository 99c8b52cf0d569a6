#pragma once
#include <Eigen/Core>

namespace unrig {

/// x >= 0 with least |a x - b| (C. L. Lawson and R. J. Hanson, Solving Least Squares Problems (1974), algorithm NNLS, chapter 23): one variable after the other is let
/// off its bound, and put back where it would become negative.
Eigen::VectorXd non_negative_least_squares(const Eigen::MatrixXd& a, const Eigen::VectorXd& b);

/// x with least |rows x - right| under `above` x >= least (ibid., problems LSI and LDP): in the coordinates in which the squares are a distance, the
/// point nearest to the origin, by NNLS on the dual. `rows` must determine x. Throws std::invalid_argument where no x satisfies the inequalities.
Eigen::VectorXd least_squares_above(const Eigen::MatrixXd& rows, const Eigen::VectorXd& right, const Eigen::MatrixXd& above, const Eigen::VectorXd& least);

}  // namespace unrig
