#pragma once
#include "fit/arrival.h"
#include "fit/fit.h"
#include "fit/joint_problem.h"
#include "fit/uncertainty.h"

namespace unrig {

/// What a finished fit says of itself.

/// All of it. `settled` is false where noise levels, spikes and the motion's windows should first be looked at again, and what the data cannot determine be held.
FitResult describe_fit(Arrival& arrival, const FitProblem& problem, bool settled = false);

FittedRun describe_run(const RunResidual& residual, const Eigen::VectorXd& theta, double chi2);

/// Standard errors and correlations of all unknowns and of the steady load of each run; what is determined where an unknown is not. The runs must have
/// been described.
void describe_parameters(const JointProblem& joint, const ParameterUncertainty& uncertainty, const StartValues& starts, FitResult& result);

/// Profile-likelihood intervals of the unknowns that `problem` asks for. Chi-square counts in units of what its rise means: where residuals are coloured,
/// the coloured variance over the plain one.
void describe_profiles(const JointProblem& joint, const ParameterUncertainty& uncertainty, const FitProblem& problem, FitResult& result);

/// Whether there is a trustworthy answer (FitResult::no_answer); where not, nothing is identified.
void judge_answer(FitResult& result);

/// Warns of every run that the model does not explain to its noise: the error bars cannot tell how far that takes the parameters.
void warn_of_mismatch(FitResult& result);

}  // namespace unrig
