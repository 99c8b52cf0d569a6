#pragma once
#include <cstddef>
#include <optional>
#include <string>

#include "fit/solver/least_squares.h"

namespace unrig {

struct ProfileOptions {
  double confidence = 0.6826894921370859;  ///< of the two-sided interval; this one is that of one standard deviation
  double variance_factor = 1;              ///< chi-square is divided by it (unrig::variance_factor, or one that allows for coloured residuals)
  double tolerance = 1e-3;                 ///< of the limits, relative to their distance from the value
  LeastSquaresOptions solve{.precision = 1e-2, .effort = LeastSquaresOptions::Effort::once};  ///< of the other unknowns, at each trial
};

/// One end of a profile-likelihood interval.
struct ProfileLimit {
  enum class End {
    crossed,    ///< chi-square has risen by the threshold
    bound,      ///< the unknown's bound comes first
    unbounded,  ///< it never does: `value` is infinite
    no_answer   ///< the model has no answer beyond `value`, and chi-square has not risen enough by then
  };
  double value = 0;
  End end = End::crossed;
};

struct ProfileInterval {
  double value = 0;  ///< of the unknown at the least chi-square
  ProfileLimit lower, upper;
  double confidence = 0;
  int evaluations = 0;
  /// Set where the search met a lower chi-square than that of the problem's values, by more than a hundredth of the threshold: the fit had not
  /// arrived, the interval is void, and a fit from here is due.
  std::optional<LeastSquaresPoint> better;
  std::string text;  ///< "0.021 to 0.034 (95 %), the lower end is the unknown's bound"
};

/// Values of one unknown for which the least of chi2 over all others exceeds chi2 at the problem's values (its minimum) by less than
/// variance_factor z^2, with z the normal quantile of the confidence: P(chi-square with one degree of freedom < z^2) = confidence.
/// Source: G. A. F. Seber and C. J. Wild, Nonlinear Regression, 1989, 5.4; D. J. Venzon and S. H. Moolgavkar, Appl. Statist. 37 (1988) 87.
///
/// An interval of an unknown at its bound is one-sided. Works for the only unknown of a problem, and for a held one. Throws
/// std::invalid_argument where there is no such unknown, or the confidence is not between 0 and 1.
ProfileInterval profile(const LeastSquaresProblem& problem, std::size_t which, const ProfileOptions& options = {});

/// z with P(|standard normal| < z) = confidence, 0 < confidence < 1.
double two_sided_quantile(double confidence);

}  // namespace unrig
