#include "fit/search/noise_of_trial.h"

#include <algorithm>
#include <vector>

#include "fit/fit_description.h"

namespace unrig {

namespace {

using ColoursFor = std::function<RunResidual::Colours(const RunResidual&, const Eigen::VectorXd& theta)>;

/// `colours_for`: those of each run that may have some.
void set_colours(JointProblem& joint, const ColoursFor& colours_for) {
  for (std::size_t r = 0; r < joint.runs().size(); ++r) {
    RunResidual& run = joint.runs()[r];
    if (run.may_be_coloured() && !run.is_aside() && run.converter(0).step == 0) run.set_colours(joint.theta(r), colours_for(run, joint.theta(r)));
  }
}

bool take_colours(Trial& trial, const std::vector<ChannelColour>& in_common, const ColoursFor& colours_for) {
  if (in_common.empty()) return false;
  set_colours(trial.arrival.joint, colours_for);
  if (decays_decide(trial)) measure(trial);  // a fit of all runs together is dear there, and may lose its way
  else fit_fully(trial, 2);
  return true;
}

/// As if the noise levels of the run were right.
RunResidual::Colours in_size_of(const RunResidual& run, const std::vector<ChannelColour>& in_common) {
  RunResidual::Colours colours(run.channels().size());
  for (std::size_t c = 0; c < colours.size(); ++c)
    for (const ChannelColour& known : in_common)
      if (known.channel == run.channels()[c]) colours[c] = known.colour.times(run.noise(c));
  return colours;
}

}  // namespace

void settle_noise(JointProblem& joint) {
  for (std::size_t r = 0; r < joint.runs().size(); ++r)
    if (RunResidual& run = joint.runs()[r]; !run.is_aside()) run.settle_noise(joint.theta(r));
}

bool take_noise_colour(Trial& trial) {
  settle_noise(trial.arrival.joint);  // levels that differ from run to run by what a fast signal added hide a colour
  const std::vector<ChannelColour> in_common = noise_colours(trial.arrival.joint);
  return take_colours(trial, in_common, [&](const RunResidual& run, const Eigen::VectorXd& theta) { return run.colours(theta, in_common); });
}

bool take_noise_colour_of_most(Trial& trial) {
  const std::vector<ChannelColour> in_common = noise_colours_of_most(trial.arrival.joint);
  return take_colours(trial, in_common, [&](const RunResidual& run, const Eigen::VectorXd&) { return in_size_of(run, in_common); });
}

bool has_colour(const JointProblem& joint) {
  return std::any_of(joint.runs().begin(), joint.runs().end(), [](const RunResidual& run) { return run.colour(0) != nullptr; });
}

void take_noise_of(Trial& trial, const Trial& other) {
  if (!has_colour(other.arrival.joint)) return;
  const std::vector<RunResidual>& known = other.arrival.joint.runs();
  JointProblem& joint = trial.arrival.joint;
  for (std::size_t r = 0; r < joint.runs().size(); ++r) joint.runs()[r].keep_noise_of(known[r]);
  fit_fully(trial, 5);
}

void take_levels_of(Trial& trial, Trial without_tones) {
  settle_noise(without_tones.arrival.joint);
  const std::vector<RunResidual>& settled = without_tones.arrival.joint.runs();
  JointProblem& joint = trial.arrival.joint;
  bool any_lower = false;
  for (std::size_t r = 0; r < settled.size(); ++r) any_lower = any_lower || settled[r].sigma(0) < joint.runs()[r].sigma(0);
  if (!any_lower) return;
  for (std::size_t r = 0; r < settled.size(); ++r) joint.runs()[r].keep_noise_of(settled[r]);
  fit_fully(trial, 5);
}

void in_noise_of_decays(Trial& trial, const std::function<void()>& search) {
  JointProblem& joint = trial.arrival.joint;
  const std::vector<ChannelColour> known = trial.decays.noise;
  if (known.empty()) return search();
  const std::vector<RunResidual> before = joint.runs();
  set_colours(joint, [&](const RunResidual& run, const Eigen::VectorXd& theta) { return run.motion().unknowns() > 0 ? in_size_of(run, known) : run.colours(theta, known); });
  search();
  for (std::size_t r = 0; r < before.size(); ++r) joint.runs()[r].keep_noise_of(before[r]);
}

}  // namespace unrig
