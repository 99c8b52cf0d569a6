#pragma once
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "fit/fit.h"

namespace unrig {

/// `fit.json` (correct/manual/results.md), with the circulation, the modes kept and the full correlation matrix. `laws`: the fitted rig's, which the file then carries whole.
/// Throws std::invalid_argument where a law at work is not among them.
std::string to_json(const FitResult& result, const std::vector<std::shared_ptr<const Effect>>& laws = {});

/// What a fit left of a channel of a run that it does not explain.
struct LeftByFit {
  std::string run, channel;
  bool in_stream = false;
  LeftInOctaves power;
};

/// Parameters of a `fit.json`, as far as `simulate` and `correct` need them.
struct FittedRig {
  std::string file;
  std::string rig_file, rig_fingerprint;  ///< of the rig that was fitted (core/rig/fingerprint.h); empty in a fit.json of an earlier version
  Wagner circulation = Wagner::within_1e4;
  Eigen::Index normal_modes = 0, torsion_modes = 0;
  std::vector<std::string> effects;  ///< at work in the fitted model
  std::vector<std::shared_ptr<const Effect>> laws;  ///< those of the effects that a user wrote down
  Eigen::Index law_steps = 1;        ///< FitResult::law_steps
  std::vector<FittedParameter> parameters;
  Eigen::MatrixXd correlation;
  std::vector<ChannelColour> noise_colour;  ///< FitResult::noise_colour
  std::vector<LeftByFit> left;              ///< FittedChannel::left; empty in a fit.json of an earlier version
  std::vector<FittedGiven> givens;     ///< numbers that stated their uncertainty, as they came out
  Eigen::MatrixXd joint_covariance;    ///< of `parameters`, then `givens`; empty without givens
  std::vector<std::string> runs;
  std::vector<std::string> fingerprints;  ///< of the runs (core/rig/fingerprint.h), empty in a fit.json of an earlier version
  std::vector<double> onset_angles;  ///< rad, of the runs; not a number in a fit.json of an earlier version, empty in a fit made in code

  /// The recording that the fit knows this file as, empty if it took no part: the same path or file; by its name, and the folders that agree, only where the fit's own file is no longer there.
  std::string recorded_as(const std::string& run_file) const;
  /// Whether the fit knows this recording's file with other readings or conditions. False for a file that took no part, and where the fit does not say.
  bool had_other_readings(const Run& run, const Rig& rig) const;
  /// In which parts the fitted rig had other numbers than this one, as the rig file calls them; none where the fit does not say. Sensors and the number of modes kept are not asked for: its parameters mean the
  /// same without them.
  std::vector<std::string> rig_differs_in(const Rig& rig) const;
  /// The value of a parameter, of this run (known likewise) where it has its own; `missing` where there is none.
  double value(const std::string& name, const std::string& run_file, double missing) const;
  const FittedParameter* find(const std::string& name, const std::string& run_file) const;
};

/// Throws InputError where the file is not a fit.
FittedRig read_fit(const std::string& path);

/// The rig with the fit's laws, and no others.
Rig with_laws(Rig rig, const FittedRig& fit);

/// Sixteen digits that tell one fit from another: of its parameters and what they were fitted with, in whatever order its runs were given.
std::string fingerprint(const FittedRig& fit);

/// "other numbers in [section] than the rig rig.toml that fit.json was fitted to"; empty where they are the same, or the fit does not say.
std::string other_rig(const Rig& rig, const FittedRig& fit);
/// Throws InputError where it has.
void refuse_other_rig(const Rig& rig, const FittedRig& fit);

/// Throws InputError where the fit says that its rig had other numbers: its parameters are multiples of them, and an answer would be wrong by as much as nobody knows. Amplifiers in the gauge's channel
/// may be others, as recordings may have been made with others. And where a parameter of the rig is none of the fit.
void check_is_fit_of(const AeroelasticModel& model, const FittedRig& fit, const std::string& run_file);

/// theta of `model` for a run: the fit's values, and the model's start values for what the fit does not name. For a run that was not fitted the slope of the normal force is that of the
/// fitted run that began at the angle nearest to `onset_angle`, because the slope falls towards stall; without that angle, the mean of the fitted slopes.
Eigen::VectorXd theta_for(const AeroelasticModel& model, const FittedRig& fit, const std::string& run_file, double onset_angle = std::numeric_limits<double>::quiet_NaN());

}  // namespace unrig
