#pragma once
#include <Eigen/Core>
#include <string>
#include <vector>

#include "core/rig/rig.h"
#include "core/run/run.h"
#include "fit/fit_files.h"

namespace unrig {

/// What a fit says of the numbers of a rig file and of one run's head that state their uncertainty.
///
/// Numbers are known by their names, those of a head by their run beside that. An error that the runs of a campaign share is as large, in proportion, in a run that took no part. What the fit knows
/// nothing of is as stated.
class FittedNumbers {
 public:
  /// Throws InputError where the fit has numbers that `rig` or `run` do not state: its parameters belong to them.
  FittedNumbers(const FittedRig& fit, const Rig& rig, const Run& run);

  bool any() const { return off_.size() > 0; }
  /// Rig and run with the numbers of the fit, and as much off them.
  Rig rig(const Eigen::VectorXd& off) const;
  Run run(const Eigen::VectorXd& off) const;
  Rig rig() const { return rig(Eigen::VectorXd::Zero(off_.size())); }
  Run run() const { return run(Eigen::VectorXd::Zero(off_.size())); }

  /// One standard deviation of what is left uncertain of the numbers, in independent directions, and how the fit's parameters go with it.
  struct Direction {
    Eigen::VectorXd off;         ///< of the numbers, in their units
    Eigen::VectorXd parameters;  ///< of FittedRig::parameters
  };
  const std::vector<Direction>& directions() const { return directions_; }
  /// Where each of the fit's parameters stands among those of `model` in a run; -1: not there, or another run's.
  std::vector<Eigen::Index> places_of_parameters(const AeroelasticModel& model, const std::string& run_file) const;
  /// The fit with the errors that its parameters have when the numbers are what they are.
  FittedRig with_numbers_known() const;

  const std::vector<std::string>& warnings() const { return warnings_; }

 private:
  const FittedRig* fit_;
  const Rig* rig_;
  const Run* run_;
  Eigen::Index of_rig_ = 0;
  Eigen::VectorXd off_;
  std::vector<Direction> directions_;
  std::vector<std::string> warnings_;
};

}  // namespace unrig
