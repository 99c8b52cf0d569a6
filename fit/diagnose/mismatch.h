#pragma once
#include <array>
#include <optional>
#include <string>
#include <vector>

#include "core/effects/effect.h"
#include "fit/force/run_states.h"
#include "fit/likelihood/joint_problem.h"

namespace unrig {

/// What a fit leaves of one channel of one run.
struct ChannelMismatch {
  std::string run, channel;
  double energy = 0;      ///< residual power over noise power
  double p_value = 1;     ///< probability that noise alone leaves as much, as coloured or as strong a line: the least of three tests, three times
  double excess = 0;      ///< energy above the noise, times samples
};

/// Where a fit and its recordings differ.
struct Mismatch {
  bool found = false;
  double p_value = 1;  ///< of the most significant channel, times the number of channels (Bonferroni)
  std::vector<ChannelMismatch> channels;
  std::vector<std::string> runs;                ///< those with a significant mismatch
  std::vector<std::array<double, 2>> time;      ///< s: the shortest stretch of each of them that holds most of the excess
  std::vector<std::array<double, 2>> frequency; ///< Hz: likewise
  std::vector<std::optional<StateDependence>> state;  ///< on which state of the rig what is left of them depends; none where the model has nonlinear effects, or of a line
  std::string summary;
};

/// "in proportion to", "with the square of", "with the power 1.4 of".
std::string in_words_of_power(double exponent);

/// Runs that are set aside are not asked. Energy: residual power against the white part of the residual itself, estimated from differences, which do not see a smooth mismatch. Colour: Bartlett's test of the
/// cumulative periodogram. A line, in runs without nonlinear laws, whose steps leave lines of their own: Fisher's test of the largest. A mismatch is found where the p-value, corrected for the number of channels, is below 1e-3 and it is a line's or the residual's power exceeds the noise's
/// by more than 5 %: a motion that is known to its noise leaves up to that, and no line.
Mismatch locate_mismatch(const JointProblem& joint);

/// Whether what is left of the gauge has a line where the frequency of an effect is known beforehand (Effect::bands), which stands out of what lies around it however much the fit leaves: noise of any colour
/// has one as strong in one campaign of a thousand. Fisher's test in each band and run (strongest_line), corrected for their number.
bool has_line(const JointProblem& joint, const Effect& e);

}  // namespace unrig
