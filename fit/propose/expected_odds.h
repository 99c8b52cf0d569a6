#pragma once
#include <Eigen/Core>
#include <random>
#include <string>
#include <vector>

#include "fit/propose/candidate_runs.h"
#include "fit/propose/fitted_explanation.h"

namespace unrig {

/// A planned run as an explanation says that it would be read: without noise, and with noise as the run that it is like has.
struct ImaginedRun {
  Run exact, noisy;
  std::vector<MotionBasis::Window> windows;
  Eigen::VectorXd linear;  ///< the linear unknowns that it was made with, where they are known
};

/// Simulates `candidate` under an explanation at theta. Signals from outside have the amplitudes of the run that it is like, where that starts alike. Throws NoAnswer where the model runs away.
ImaginedRun imagined(const FittedExplanation& truth, const CandidateRun& candidate, const Eigen::VectorXd& theta, std::mt19937_64& random);

/// The run against a model: its readings, weighted with the noise of the run that it is like. `exact`: those without noise.
RunResidual residual_of(const FittedExplanation& model, const ImaginedRun& run, const CandidateRun& candidate, bool exact);

/// Expected log odds of the true explanation against another from one more run, to first order.
///
///   E[ln p(y | i, D) - ln p(y | j, D)] = 1/2 (d^T S_j^-1 d + tr(S_j^-1 S_i) - n + ln det S_j - ln det S_i),   S = 1 + G H^-1 G^T
///
/// the divergence of S. Kullback and R. A. Leibler, Annals of Mathematical Statistics 22 (1951) 79, between normal distributions of the readings: d the difference of both predictions, G how they move with the
/// parameters, H what the runs at hand know of these. All in units of the noise, motion, initial state and offsets of the run eliminated. As a criterion for the next experiment:
/// G. E. P. Box and W. J. Hill, Technometrics 9 (1967) 57.
///
/// `truth` and `other` stand at their fits, `runs` is what the truth would read there. Not finite where a model has no answer.
double expected_log_odds(const FittedExplanation& truth, const FittedExplanation& other, const ImaginedRun& run, const CandidateRun& candidate);

/// Log odds by which a run must be expected to decide so that with a probability of 95 % it yields 5 (odds of 150, "very strong": R. E. Kass and A. E. Raftery, Journal of the American
/// Statistical Association 90 (1995) 773) for the truth: the log odds of a run scatter by sqrt(2 times their expectation), L - 1.645 sqrt(2 L) >= 5.
constexpr double enough_to_decide = 13.6;

}  // namespace unrig
