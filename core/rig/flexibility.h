#pragma once
#include <Eigen/Core>
#include <string>
#include <vector>

#include "core/files/error.h"

namespace unrig {

/// A flexibility matrix as a rig file gives it (seed, Eq. 3.2), before it is trusted.
struct GivenFlexibility {
  InputError::Place place;
  std::string name;      ///< "normal.flexibility"
  Eigen::MatrixXd rows;  ///< A_ij, SI
  Eigen::MatrixXd std;   ///< standard deviation of each entry where it was measured; empty otherwise
};

/// Largest relative error of a number printed with four significant digits: half a unit of the fourth, at worst in 1000.
inline constexpr double printed_rounding = 5e-4;

/// The symmetric matrix that is meant: the mean of the entries across the diagonal.
///
/// Throws InputError, naming the elements, where
/// - a diagonal entry is not positive: no load may move its own point backwards;
/// - entries across the diagonal differ by more than 1 % of sqrt(A_ii A_jj) and, if measured, by more than three standard deviations,
///   against Maxwell's reciprocity;
/// - the matrix is not positive definite within the rounding of its entries: no load may do negative work.
///
/// The last is judged on S_ij = A_ij / sqrt(A_ii A_jj), so that stiff and soft elements count alike. |S_ij| <= 1, so rounding (or
/// measuring) moves each entry by at most eps = `printed_rounding` (or one standard deviation), the matrix by a symmetric E with ||E||_2 <=
/// max_i sum_j |E_ij| <= n eps, and no eigenvalue by more (Weyl). An eigenvalue below -n eps is an error; between that and zero it is added
/// to `warnings`. The seed's printed matrix is such a case: its smallest is -1.7e-3, and n eps is 8.5e-3.
Eigen::MatrixXd checked_flexibility(const GivenFlexibility& given, std::vector<std::string>& warnings);

}  // namespace unrig
