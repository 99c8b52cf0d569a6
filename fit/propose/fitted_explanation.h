#pragma once
#include <Eigen/Core>
#include <functional>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include "fit/fit.h"
#include "fit/propose/candidate_runs.h"
#include "fit/propose/explanations.h"
#include "fit/search/arrival.h"
#include "fit/uncertainty/uncertainty.h"

namespace unrig {

/// An explanation, fitted to the runs at hand. Its runs count with the noise that the best explanation leaves of them, so that chi-squares compare.
class FittedExplanation {
 public:
  /// Fits it as `unrig fit` does, from the starts that its laws have. Throws InputError where one of its effects can act in none of the runs.
  FittedExplanation(const Explanation& explanation, const Rivals& rivals, const std::function<void(const std::string&)>& progress);
  FittedExplanation(const FittedExplanation&) = delete;
  FittedExplanation& operator=(const FittedExplanation&) = delete;

  const Explanation& explanation() const { return explanation_; }
  /// Why the fit is not to be trusted; empty: it is.
  const std::string& no_answer() const { return no_answer_; }
  JointProblem& joint() { return arrival_->joint; }
  const JointProblem& joint() const { return arrival_->joint; }
  const AeroelasticModel& model() const { return *arrival_->model; }
  const std::vector<Run>& runs() const { return problem_.runs; }
  /// Sum over all readings of the logarithm of their noise: the least has the best explanation.
  double log_noise() const;
  /// Takes over the noise of the runs, as much more as `reference` leaves of each beyond it, and searches again; then chi2 and covariance are known.
  void settle(const FittedExplanation& reference);
  double chi2() const { return chi2_; }
  /// What the runs at hand, and what everybody knows of such numbers, say of the unknowns that all runs share and that are not held, those of single runs eliminated.
  const Eigen::MatrixXd& information() const { return information_; }
  /// Unknowns that are not held, the runs' linear ones included.
  int variables() const;

  /// theta for a planned run: what all runs share, and what the run that it is like has of its own.
  Eigen::VectorXd theta(const CandidateRun& candidate) const { return joint().theta(candidate.like); }
  /// The same with the unknowns drawn from their joint normal distribution, inside their bounds.
  Eigen::VectorXd drawn_theta(const CandidateRun& candidate, std::mt19937_64& random) const;

  /// chi-square of all runs at their least with `added` beside them, less that without it, and whether the search arrived there.
  struct Refit {
    bool arrived = false;
    double chi2 = 0;
  };
  Refit refit(const RunResidual& added, std::size_t like) const;

 private:
  Explanation explanation_;
  FitProblem problem_;  // the arrival looks at its runs
  std::unique_ptr<Arrival> arrival_;
  ParameterUncertainty uncertainty_;
  Eigen::MatrixXd information_;
  std::string no_answer_;
  double chi2_ = 0;
};

}  // namespace unrig
