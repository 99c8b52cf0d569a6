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
  /// Another run can only add to the least chi-square: a refit that leaves less shows that the fit to the runs at hand has missed it. Searches from where that refit ended; false where it finds no less.
  bool adopt(const std::vector<Unknown>& better);
  /// What the runs at hand, and what everybody knows of such numbers, say of the unknowns that all runs share, those of single runs eliminated; in the order of `shared`.
  const Eigen::MatrixXd& information() const { return information_; }
  /// Parameters that one more run may move: those that all runs share, and those that a run has of its own.
  const std::vector<Eigen::Index>& shared() const { return shared_; }
  std::vector<Eigen::Index> own(std::size_t run) const;
  /// Unknowns that are not held, the runs' linear ones included.
  int variables() const;

  /// theta for a planned run: what all runs share, and what the run that it is like has of its own.
  Eigen::VectorXd theta(const CandidateRun& candidate) const { return joint().theta(candidate.like); }
  /// The same with the unknowns drawn from their joint normal distribution, inside their bounds.
  Eigen::VectorXd drawn_theta(const CandidateRun& candidate, std::mt19937_64& random) const;

  /// chi-square of all runs at their least with another beside them, less that without it. Parameters of effects that the runs at hand leave open are free in it.
  struct Refit {
    bool arrived = false;
    double chi2 = 0;
    std::vector<Unknown> unknowns;  ///< where it ended; those of the added run behind the others
  };
  /// Searched from `start`, or from where the fit to the runs at hand stands. `like`: the run at hand whose own parameters the added one then starts from.
  Refit refit(const RunResidual& added, std::size_t like, const std::vector<Unknown>& start = {}) const;
  /// All the way as `unrig fit` goes, to the runs at hand and to `as_read`, the added run with its noise; from there as refit.
  Refit refit_anew(const RunResidual& added, const Run& as_read) const;

  static constexpr double clearly_less = 1;  ///< of chi-square

 private:
  Refit search(std::vector<RunResidual> all, const std::vector<Unknown>& start) const;

  Explanation explanation_;
  FitProblem problem_;  // the arrival looks at its runs
  std::unique_ptr<Arrival> arrival_;
  ParameterUncertainty uncertainty_;
  Eigen::MatrixXd information_;
  std::vector<Eigen::Index> shared_;
  std::string no_answer_;
  double chi2_ = 0;
};

}  // namespace unrig
