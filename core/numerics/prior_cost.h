#pragma once
#include <Eigen/Core>

namespace unrig {

/// What unknowns x with the prior N(0, L L^T) cost in twice the logarithm of the evidence, beside their best fit without a prior:
///
///   -2 ln integral of exp(-|R (x - estimate)|^2 / 2) N(x; 0, L L^T) dx = ln det(I + S^2) + sum of (U^T R estimate)^2 / (1 + S^2),   R L = U S V^T,
///
/// where the least squares of the data are at `estimate` and rise from there by |R (x - estimate)|^2. The second term gives back what a free fit has taken of the noise in directions that the data hardly know.
/// `triangle` R: rows x n; `estimate`: n; `likely` L: n x m. Source: C. E. Rasmussen and C. K. I. Williams, Gaussian Processes for Machine Learning (2006), eq. 2.30, with the covariance L L^T.
double prior_cost(const Eigen::MatrixXd& triangle, const Eigen::VectorXd& estimate, const Eigen::MatrixXd& likely);

}  // namespace unrig
