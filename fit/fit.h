#pragma once
#include <Eigen/Core>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "core/law/law.h"
#include "core/model/aeroelastic_model.h"
#include "core/rig/rig.h"
#include "core/run/run.h"
#include "core/model/wagner.h"
#include "fit/likelihood/left_in_octaves.h"
#include "fit/likelihood/noise_colour.h"
#include "fit/uncertainty/determined.h"
#include "fit/uncertainty/profile.h"
#include "fit/uncertainty/undetermined.h"

namespace unrig {

/// Which rig explains these recordings? All runs share stiffness, damping and apparent mass; every run has its own normal-force slope, steady
/// load, motion and initial state.
struct FitProblem {
  Rig rig;
  std::vector<Run> runs;
  Wagner circulation = Wagner::within_1e4;
  std::vector<std::string> effects;     ///< ids of core/effects/table.cpp that are at work
  StartValues start;                    ///< start values other than the rig file's, by parameter name
  std::vector<std::string> profile;     ///< parameters to give profile-likelihood intervals of, or "all"
  std::function<void(const std::string&)> progress;  ///< told what is being done; empty: silent
};

struct FittedParameter {
  std::string name;
  std::string unit;
  std::string run;        ///< file of the run it belongs to; empty where all share it
  double value = 0;
  double std_error = 0;   ///< one standard deviation; NaN where it could not be had
  double std_error_white = 0;     ///< the same if the residuals were white
  double std_error_coloured = 0;  ///< the same from the residuals' own spectra
  double start = 0;
  bool identified = true;
  std::string advice;     ///< where not identified: why, and what to record
  std::string effect = {};  ///< whose it is; empty: the rig's own
  int place = -1;           ///< among the parameters of that effect, from 0
  Role role = Role::effect;
  int mode = -1;            ///< of a rig known as modes: whose it is, from 0
};

struct FittedChannel {
  std::string name;
  std::string unit;
  Eigen::Index samples = 0;  ///< that counted
  std::size_t missing = 0;   ///< without a reading in the file
  Eigen::Index spikes = 0;   ///< left out as electrical spikes
  double rms_residual = 0;
  double noise = 0;          ///< standard deviation of the channel's white part, estimated from its differences
  std::size_t clipped = 0;   ///< left out as readings at the end of the converter's range
  std::size_t bad = 0;       ///< left out as isolated bad readings
  LeftInOctaves left;        ///< what the model leaves beyond its noise; no octaves where it explains the run
};

struct FittedRun {
  std::string file;
  std::string fingerprint;  ///< of its readings (core/rig/fingerprint.h)
  double onset_angle = 0;  ///< rad (RunConditions)
  Eigen::Index samples = 0;
  std::optional<Hold> hold;  ///< before the release of a pluck, left out
  double chi2 = 0;
  Eigen::Index degrees_of_freedom = 0;
  std::vector<FittedChannel> channels;  ///< the fitted outputs, then `alpha` where the motion was estimated
  bool in_stream = false;
  bool aside = false;    ///< it crosses the corners of a law for so long that no search follows it: it had no part in the fit
  double whiteness = 1;  ///< probability that white noise looks at least as coloured as the residual
  double followed = 1;   ///< share of the readings' variance that the model follows (fit/likelihood/share_followed.h), of the channel that it follows least
  double reduced_chi2() const { return chi2 / static_cast<double>(degrees_of_freedom); }
  /// Whether chi-square is what noise would leave: it scatters by sqrt(2/n), the noise level that it counts in, and its square, by a few per cent.
  bool explained() const;
};

/// A number of the rig file or of a run's header that states its uncertainty, and what the recordings say of it.
struct FittedGiven {
  std::string name;  ///< "normal.mass[13]"
  std::string unit;
  std::string run;   ///< file of the run whose header has it; empty of the rig's
  double stated = 0, stated_std = 0;
  double value = 0, std_error = 0;
};

struct ProfiledParameter {
  std::string name, run, unit;
  std::vector<ProfileInterval> intervals;  ///< 68 % (one standard deviation) and 95 %
};

struct FitResult {
  bool converged = false;
  std::string message;
  std::string no_answer;  ///< why these numbers are not to be trusted, and what to do; empty: they are
  double chi2 = 0;
  Eigen::Index observations = 0;
  Eigen::Index variables = 0;  ///< nonlinear and linear unknowns together
  int evaluations = 0;         ///< of the joint model with its derivatives
  double seconds = 0;
  std::vector<FittedParameter> parameters;
  Eigen::MatrixXd correlation;  ///< of `parameters`; zero beside the diagonal for those that were held
  std::vector<DeterminedCombination> determined;  ///< where a parameter is not; their unknowns are the first of `parameters`
  std::vector<ProfiledParameter> profiles;
  std::vector<FittedRun> runs;
  std::vector<ChannelColour> noise_colour;  ///< of the fitted readings, where they have one (fit/likelihood/noise_colour.h)
  bool coloured = false;        ///< which of the two standard errors `std_error` is
  std::vector<std::string> effects;
  std::map<std::string, LearntOn> learnt_on;  ///< how far the runs took what each law at work looks at, by its id
  Eigen::Index law_steps = 1;   ///< nonlinear laws were followed in so many times the steps that they ask for
  std::string rig_file;
  std::string rig_fingerprint;  ///< of the rig's numbers (core/rig/fingerprint.h)
  std::string program, command; ///< version and command line that made this result; empty where it was not read from or for a file
  std::vector<FittedGiven> givens;
  Eigen::MatrixXd joint_covariance;  ///< of `parameters`, then `givens`; empty without givens
  Wagner circulation = Wagner::within_1e4;
  Eigen::Index normal_modes = 0, torsion_modes = 0;
  std::vector<std::string> warnings;

  double reduced_chi2() const { return chi2 / static_cast<double>(observations - variables); }
  double aic() const { return chi2 + 2 * static_cast<double>(variables); }
  double bic() const;
};

/// Joint least-squares fit (Ceres, Levenberg-Marquardt). The residuals are divided by each channel's own noise level; motion, initial states, steady loads
/// and offsets are eliminated exactly in every step (RunResidual). The fitted window grows from a few periods to the whole record, because
/// a resonance that is off by a tenth has slipped whole cycles after ten. It starts from the strongest line in the spectra of the free decays, and where the
/// whole record is not explained in the end, once more from stiffnesses around it.
///
/// Standard errors: where the residual of a run is white (1 % test of its cumulative periodogram), the inverse Gauss-Newton Hessian, times the reduced
/// chi-square where that exceeds one; where any is coloured, the covariance that follows from the residuals' own spectra (fit/uncertainty/coloured_noise.h).
/// Both are in the result. What the runs do not determine is held; the standard errors of the others allow for as much as it may be off
/// (fit/uncertainty/undetermined.h), and where that leaves nothing known of one it is not identified either: `determined` then has the combination that is.
///
/// There is no answer (`no_answer`) where the search has not converged, a run is left with more than half of the variance of a channel (fit/likelihood/share_followed.h) and not with its
/// noise (a wrong minimum, or not this rig), fewer than 20 degrees of freedom remain (the scatter itself is then known to worse than 1/sqrt(40)), or nothing is determined.
/// No parameter is `identified` then.
/// Throws InputError where a run does not belong to the rig or is too short to say more than where it starts, or a name belongs to no parameter.
FitResult fit(const FitProblem& problem);

/// The model of a set of runs: one basis, rich enough for all of them.
/// With effects at work their parameters are among the model's; `higher-mode` takes all modes that the rig has.
AeroelasticModel model_of(const Rig& rig, const std::vector<Run>& runs, Wagner circulation, const std::vector<std::string>& effects = {});

}  // namespace unrig
