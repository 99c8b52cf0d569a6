#pragma once
#include <Eigen/Core>
#include <vector>

#include "fit/likelihood/joint_problem.h"

namespace unrig {

/// Where the parameters of one mode of a rig known as modes stand in theta.
struct ModalPlace {
  Eigen::Index mass, stiffness, damping, participation;
};
ModalPlace place_of_mode(const AeroelasticModel& model, std::size_t mode);

/// Frequency [Hz] of mode `mode` (from 0) at theta, undamped.
double modal_frequency(const AeroelasticModel& model, const Eigen::VectorXd& theta, std::size_t mode);

/// Half the highest sampling rate of the runs [Hz]: a mode above it leaves no mark at its own frequency, and a search that took one there would be fitting something else.
double highest_nyquist(const std::vector<RunResidual>& runs);

/// Modes that may move, and are above it at theta.
bool moves_above(const JointProblem& joint, const Eigen::VectorXd& theta, double nyquist);

/// What that leaves to an unknown that is the stiffness of a mode whose mass is held: a bound, at which a search can end. Infinite for any other.
double stiffest_below(const JointProblem& joint, const Unknown& unknown, double nyquist);

}  // namespace unrig
