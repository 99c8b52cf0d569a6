#pragma once
#include <Eigen/Core>
#include <string>

#include "fit/solver/least_squares.h"

namespace unrig {

/// One way of searching.
struct SearchStrategy {
  std::string name = "Levenberg-Marquardt";
  bool dogleg = false;
  bool nonmonotonic = false;       ///< chi2 may rise for a few steps
  bool column_scaling = true;      ///< Jacobian columns to unit length at the start
  bool logarithms = false;         ///< of all unknowns that are not zero: they keep their sign
  double first_radius = 1e4;       ///< of the trust region, in scaled unknowns
  /// Newton homotopy: the residual is r(x) - (1 - t) r(x0), for which x0 is exact at t = 0; t goes to 1 in this many steps (E. L. Allgower and
  /// K. Georg, Numerical Continuation Methods, 1990). 0: none.
  int homotopy_steps = 0;
};

struct SearchLimits {
  int iterations = 0;
  double relative_change = 0;  ///< of chi2 in one step
  double precision = 0;        ///< Gauss-Newton step left, in standard errors
  double enough = 0;           ///< chi2
  Goal goal = {};
};

struct SearchOutcome {
  LeastSquaresPoint point;  ///< with its Jacobian; not finite where the start was not
  int iterations = 0;
  int evaluations = 0;      ///< with derivatives
};

/// Trust-region search (Ceres) from `start` over the unknowns that are not held, inside their bounds.
SearchOutcome search(const LeastSquaresProblem& problem, const LeastSquaresPoint& start, const SearchStrategy& strategy, const SearchLimits& limits);

}  // namespace unrig
