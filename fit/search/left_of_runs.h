#pragma once
#include <Eigen/Core>
#include <vector>

#include "fit/likelihood/joint_problem.h"

namespace unrig {

constexpr double run_away = 1e30;  ///< variance of a run whose model does not stay finite: infinite, but two of them can be compared

/// What a fit leaves of a run.
struct LeftOfRun {
  double variance = 0;  ///< residual power over noise power
  double samples = 0;
  double independent = 0;  ///< of them, as the residual's colour says
  double angle_variance = 1, angle_samples = 0;  ///< the same of the angle, where the motion is estimated
  double unknowns = 0;  ///< linear ones that its readings tell of, each as what it costs the evidence over the logarithm of all samples
};
/// Of each run in turn.
std::vector<LeftOfRun> left_of_runs(const JointProblem& joint);

}  // namespace unrig
