#pragma once
#include <Eigen/Core>
#include <vector>

#include "fit/solver/least_squares.h"

namespace unrig {

/// Where a point's residual would fall away beyond a bound: the unknown stays on it.
bool pressed_against_bound(const LeastSquaresUnknown& unknown, double value, double slope);

/// The linearised problem at a point, solved: dx = argmin |r + J dx| over the unknowns that are neither held nor pressed against a bound.
struct GaussNewton {
  std::vector<Eigen::Index> free;     ///< those unknowns
  std::vector<Eigen::Index> pressed;  ///< those at a bound that chi2 would fall beyond
  Eigen::VectorXd step;               ///< of all unknowns; zero where they stay
  double promised = 0;                ///< chi2 reduction of the linear model, |Q^T r|^2: does not depend on the units or the scale of the unknowns
  double rounding = 0;                ///< chi2 reduction that rounding of the values alone could promise, |eps |J| |x||^2
  Eigen::Index rank = 0;              ///< directions the residuals respond to, those towards a pressed bound included
};

/// By Householder QR with column pivoting of the Jacobian with its columns scaled to unit length; directions below 1e-13 count as none.
GaussNewton gauss_newton(const LeastSquaresProblem& problem, const LeastSquaresPoint& point);

/// How far a point is from the least of chi-square, as seen from it.
struct Standing {
  GaussNewton next;
  double step_left = 0;         ///< length of the next step, in standard errors: sqrt(promised / variance factor)
  bool within_rounding = false; ///< the step is no more than rounding makes it
};
Standing standing(const LeastSquaresProblem& problem, const LeastSquaresPoint& point);

/// Gauss-Newton steps for as long as they bring the point nearer, until the step left is shorter than `precision` standard errors (0: until no
/// digit moves). Large residuals make Gauss-Newton converge slowly, by a constant factor per step; Anderson's acceleration over the last five
/// steps (D. G. Anderson, J. ACM 12 (1965) 547; H. F. Walker and P. Ni, SIAM J. Numer. Anal. 49 (2011) 1715) makes up for it.
/// Returns the number of evaluations.
int refine(const LeastSquaresProblem& problem, double precision, LeastSquaresPoint& point, Standing& standing);

/// `values` with those unknowns that are not held moved into their bounds.
Eigen::VectorXd inside_bounds(const LeastSquaresProblem& problem, Eigen::VectorXd values);

}  // namespace unrig
