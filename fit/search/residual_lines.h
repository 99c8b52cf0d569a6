#pragma once
#include <Eigen/Core>
#include <cmath>
#include <vector>

#include "core/effects/effect.h"
#include "fit/likelihood/joint_problem.h"

namespace unrig {

/// Power of what a fit leaves of the gauge in each run, over the power of white noise with its variance, as a function of frequency.
class ResidualLines {
 public:
  explicit ResidualLines(const JointProblem& joint);
  double power(std::size_t run, double frequency) const { return is_in(run, frequency) ? power_[run][line(run, frequency)] : 0; }
  bool is_in(std::size_t run, double frequency) const { return frequency > 0 && line(run, frequency) < power_[run].size(); }
  double resolution(std::size_t run) const { return 1 / duration_[run]; }

 private:
  static constexpr Eigen::Index padding = 8;  // the nearest line is at most a sixteenth of the resolution away, and shows 0.987 of the power
  Eigen::Index line(std::size_t run, double frequency) const { return static_cast<Eigen::Index>(std::lround(frequency * duration_[run] * static_cast<double>(padding))); }

  std::vector<Eigen::VectorXd> power_;
  std::vector<double> duration_;  // s
};

/// Starts of a tone: where the lines, followed through the bands of its first parameter, add up to most, each with the further parameters of every one of its starts.
std::vector<Eigen::VectorXd> tone_starts(const ResidualLines& lines, const JointProblem& joint, const Effect& e);

}  // namespace unrig
