#pragma once
#include <string>

#include "fit/search/arrival.h"
#include "fit/fit.h"
#include "fit/likelihood/joint_problem.h"
#include "fit/uncertainty/uncertainty.h"

namespace unrig {

/// What a finished fit says of itself.

/// What is to be done before: nothing; or noise levels, spikes and the motion's windows looked at again, what the data cannot determine held, and the steps in which nonlinear laws are followed halved until that moves nothing.
enum class Settle { nothing, all };

class InexactRig;

/// All of it. `inexact`: of a rig that states uncertainties of its numbers, which `arrival` was found with; the search goes on once the rest has been looked at again.
FitResult describe_fit(Arrival& arrival, const FitProblem& problem, Settle first, InexactRig* inexact = nullptr);

/// What a steady load before the motion reads in a run, per unit coefficient on all strips; 0 where there is none, or no gauge that shows it.
double reading_of_steady_load(const RunResidual& residual);

/// The colour that the runs' readings have in common, channel by channel, from what the fit leaves of them at rest.
std::vector<ChannelColour> noise_colours(const JointProblem& joint);
/// That of most of them (colour_of_most): of a fit that may leave a mismatch in the others.
std::vector<ChannelColour> noise_colours_of_most(const JointProblem& joint);

FittedRun describe_run(const RunResidual& residual, const Eigen::VectorXd& theta, double chi2);

/// Standard errors and correlations of all unknowns and of the steady load of each run; what is determined where an unknown is not. The runs must have
/// been described.
void describe_parameters(const JointProblem& joint, const ParameterUncertainty& uncertainty, const StartValues& starts, FitResult& result);

/// Profile-likelihood intervals of the unknowns that `problem` asks for. Chi-square counts in units of what its rise means: where residuals are coloured,
/// the coloured variance over the plain one.
void describe_profiles(const JointProblem& joint, const ParameterUncertainty& uncertainty, const FitProblem& problem, FitResult& result);

/// Throws InputError for a run that its own unknowns take up altogether: it would only seem to be explained.
void check_lengths(const JointProblem& joint);

/// Why so many samples tell nothing of so many unknowns; empty where they do.
std::string too_few_samples(Eigen::Index observations, Eigen::Index variables);

/// Whether there is a trustworthy answer (FitResult::no_answer); where not, nothing is identified.
void judge_answer(FitResult& result);

/// Warns of every run that says nothing by itself: too short to tell noise from signal, or a step whose shaft rests. What it should have told is held.
void warn_of_silent_runs(const JointProblem& joint, FitResult& result);

/// Warns of every run that the model does not explain to its noise: the error bars cannot tell how far that takes the parameters.
void warn_of_mismatch(FitResult& result);

/// No answer where some run is left with more than its noise and that moves a parameter: where the earlier halves of the runs alone would have it further off than noise of the residual's own colour moves
/// it in one of a thousand fits (ParameterUncertainty::earlier_half). Noise, of whatever colour, goes on alike; what a model lacks goes with the swing or the time.
void judge_misfit(const JointProblem& joint, const ParameterUncertainty& uncertainty, FitResult& result);

}  // namespace unrig
