#pragma once
#include <string>
#include <vector>

#include "fit/fit.h"
#include "fit/likelihood/joint_problem.h"

namespace unrig {

/// A mode of a rig known as modes that the readings show and the fit does not follow.
struct UnfittedMode {
  std::size_t mode = 0;   ///< from 0
  std::string run, channel;
  double frequency = 0;   ///< of the line [Hz]
  double over_floor = 0;  ///< power of the line in the standardised residual over what is left around it
};

/// Lines of the readings, more than twenty times their surroundings (noise does so by exp(-20)), belong to the mode of the rig file nearest to them, if that is within a factor of 1.25. A line
/// is followed where less than half of its power is left. A mode is not fitted where it has a line that is not followed, which stands out of the standardised residual too, and none
/// that is. Modes that were held and lie above half the sampling rate have none.
std::vector<UnfittedMode> unfitted_modes(const JointProblem& joint);

/// No answer where there is such a mode: the message names it.
void refuse_unfitted_modes(const JointProblem& joint, FitResult& result);

}  // namespace unrig
