#pragma once
#include <Eigen/Core>
#include <cstddef>
#include <string>
#include <vector>

#include "fit/solver/least_squares.h"

namespace unrig {

/// What the data say about one unknown.
struct Identifiability {
  std::string name;
  double value = 0;
  /// One standard deviation, in the unknown's unit. At a bound that chi-square presses against: how far into the allowed range chi-square has
  /// risen by the variance factor (one-sided). NaN where held or not determined.
  double std_error = 0;
  bool held = false;
  bool determined = true;
  bool at_bound = false;
  /// Not determined: what stands in the way and what of it is determined ("only together with others; determined: k / m, c / m").
  std::string combination;
};

/// A direction in which the unknowns can change together without any residual noticing.
struct UndeterminedDirection {
  Eigen::VectorXd change;  ///< of all unknowns, in their units; the pivot changes by its own value (by its scale, or 1, where it is zero)
  std::size_t pivot = 0;   ///< the unknown to hold, if this direction is to be taken away
  std::string text;        ///< "m +1 % with k +1 %, c +1 %"
};

/// One unknown x and others p that can change together without any residual noticing: the combination that the data do determine.
struct Tie {
  std::string name;
  double own = 0;                    ///< value of x
  std::vector<std::string> pivots;
  std::vector<double> pivot_values;
  std::vector<double> slope;         ///< d x / d p along the undetermined direction

  void add(const std::string& pivot, double value, double slope_with_it);
  /// Whether it is x times simple powers of the pivots ("k / m"); else it is the sum x - slope p.
  bool is_product() const;
  std::string determined() const;
  double value() const;
  double gain() const;  ///< d combination / d x
  /// d ln x / d ln p, NaN where one of them is zero.
  double relative(std::size_t k) const;
};

struct CovarianceOptions {
  /// Least singular value, of the Jacobian with its columns scaled to unit length, that counts as a response. Derivatives that are exact to
  /// rounding leave 1e-15 where there is none; data that determine a direction at all leave 1e-9 (Bennett5 of NIST) or more.
  double rank_threshold = 1e-10;
  double variance_factor = 1;  ///< multiplies the covariance (unrig::variance_factor where the noise level is not known beforehand)
  /// Unknowns to hold first when something has to be held: those best known from elsewhere. They become pivots where they can.
  std::vector<std::size_t> hold_first;
};

struct Covariance {
  /// Of all unknowns: factor (J^T J)^-1 in what is determined; zero beside those held or at a bound, NaN beside those not determined.
  Eigen::MatrixXd matrix;
  std::vector<Identifiability> unknowns;
  std::vector<UndeterminedDirection> undetermined;
  Eigen::Index rank = 0;                ///< of the Jacobian of the unknowns that are neither held nor at a bound
  Eigen::VectorXd singular_values;      ///< of that Jacobian, columns scaled to unit length, falling
  std::string text() const;             ///< a sentence for each unknown that is not determined or at a bound; empty: all is well
};

/// Linearised covariance at a point, by singular value decomposition of the column-scaled Jacobian: the normal equations, which would square its
/// condition number, are not formed. An unknown is determined where no undetermined direction moves it by more than 1e-4 of its part
/// in the scaled null space. Unknowns pressed against a bound are taken as fixed there for the others.
///
/// Always answers: what has no error bar is named, with the combination that is stuck.
/// Source: G. A. F. Seber and C. J. Wild, Nonlinear Regression, 1989, ch. 3 and 5; G. H. Golub and C. F. Van Loan, Matrix Computations, 5.5.
Covariance covariance(const LeastSquaresProblem& problem, const LeastSquaresPoint& point, const CovarianceOptions& options = {});

}  // namespace unrig
