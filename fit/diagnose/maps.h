#pragma once
#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "fit/likelihood/joint_problem.h"

namespace unrig {

/// Short-time spectrum of a record: power of overlapping Hann windows, a sixth of the record long. White noise of standard deviation 1 has an expected power of 1 everywhere.
struct TimeFrequencyMap {
  Eigen::VectorXd time;       ///< s, the windows' middles
  Eigen::VectorXd frequency;  ///< Hz, the bands' middles
  Eigen::MatrixXd power;      ///< bands x windows
  bool noise_above = false;   ///< what lies above the highest band is left out: nothing stands out of the noise there
};

/// About `columns` windows, and at most `most_bands` bands of averaged lines, up to where lines stand out of the noise (everything where none do). `start`, `dt` [s].
/// Throws std::invalid_argument as amplitude_spectrum does.
TimeFrequencyMap time_frequency(const Eigen::VectorXd& x, double start, double dt, Eigen::Index columns = 96, Eigen::Index most_bands = 96);

/// Mean of a force over even cells of displacement and velocity, the outermost half per cent at either end left out (S. F. Masri and T. K. Caughey, J. Applied Mechanics 46 (1979) 433).
struct RestoringForceMap {
  Eigen::VectorXd displacement, velocity;  ///< middles of the cells
  Eigen::MatrixXd force;                   ///< velocities x displacements; NaN where fewer than three samples were
  std::string displacement_unit, velocity_unit, force_unit;
};
RestoringForceMap restoring_force(const Eigen::VectorXd& displacement, const Eigen::VectorXd& velocity, const Eigen::VectorXd& force, Eigen::Index cells = 21);

/// What a fit leaves of a run, to look at.
struct ResidualMaps {
  std::string run, channel;
  TimeFrequencyMap time_frequency;  ///< of the residual of the first fitted channel in units of its noise
  /// What the channel reads and the model lacks, in the channel's unit, over displacement and velocity of the first normal mode in the model, at the element that the dead weights hung at.
  /// Modal rigs: of the first mode, in the gauge's unit. Only for runs `of_force`.
  std::optional<RestoringForceMap> force;
};

/// Maps of every run of a fit without nonlinear effects; the force only of the runs (files) named in `of_force`.
std::vector<ResidualMaps> residual_maps(const JointProblem& joint, const std::vector<std::string>& of_force);

}  // namespace unrig
