#pragma once
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "fit/diagnose/diagnose.h"
#include "fit/diagnose/explanation.h"
#include "fit/search/effect_search.h"

namespace unrig {

/// Rig and runs with the errors that their numbers may have: those that rig file and heads state or, where none of them states any, the usual ones (core/rig/default_errors.h).
FitProblem with_errors_of_files(const DiagnoseProblem& problem);

/// The rig file and the heads of the runs as a candidate for what a baseline leaves: their numbers within the errors that they may have.
struct RigDescription {
  std::shared_ptr<const FitProblem> problem;  ///< rig and runs as they come out; `trial` looks at them
  std::vector<Run> heldout;                   ///< likewise
  Trial trial;                                ///< the best fit with nothing missing there
  double promised = 0;                        ///< share of the excess of chi-square that one linear step promised to remove
  double left = 0;                            ///< reduced chi-square of the fit that the numbers were found with, laws included
  double cost = 0;                            ///< z^T z + ln det(I + K), to be added to a difference of BIC
  std::vector<FittedGiven> numbers;           ///< all of them, with their errors
  Eigen::VectorXd deviations;                 ///< of the errors of the files, at which they stand
  std::optional<Trial> from;                  ///< what it was asked of, in the noise that it left, where that has a colour

  Setting setting() const { return {problem.get(), &heldout, deviations}; }

};

/// The description as something missing. Its parameters are the `numbers` that moved most in units of the usual error, those by one standard deviation or more: five at most, one at least; `start` is what the file says.
MissingEffect as_missing(std::vector<FittedGiven> numbers);

/// Parameters and numbers together, from a fit of the rig, with laws or without:
///
///   least of chi-square(theta, z) + z^T z,   twice the logarithm of the evidence = -(difference of BIC + z^T z + ln det(I + K)),
///
/// z independent standard normal deviations of the numbers, K what the runs say of z with theta eliminated (fit/givens/inexact_rig.h). None where one linear step promises less than the share
/// `least` of the excess of chi-square and, of a fit without effects, to leave something, and where noise of a colour does not explain what the step leaves; if it does, all is asked in that noise.
std::optional<RigDescription> describe_rig(const DiagnoseProblem& problem, const Trial& from, double least = 0.5);

/// By how many per cent the loads at the ends of the steps change from one fit to another, on the mean; 0 where no run is a step. Load: s rho U^2 b L of a strip (core/model/strip_theory.h).
double change_of_load(const FitProblem& from, const FitResult& before, const FitProblem& to, const FitResult& after);

}  // namespace unrig
