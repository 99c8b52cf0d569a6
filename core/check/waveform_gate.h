#pragma once
#include <optional>
#include <vector>

#include "core/check/gate.h"
#include "core/check/run_estimate.h"

namespace unrig {

/// A campaign that is plausible in frequency and steady load, with what its decays say.
struct PlausibleCampaign {
  const CheckModel& model;
  const std::vector<Run>& runs;
  const std::vector<RunEstimate>& estimates;  ///< of each run
  double stiffness = 0;  ///< ln of the scale in vacuum
  double apparent = 0;   ///< ln of the apparent-mass coefficient
};

/// What the shape of the gauge behind a step says, where frequency and steady load are right: a gauge or calibration element that is another, or a gauge channel that is late.
///
/// Of the right rig the gauge follows a simulation to a twentieth of its variation; with hidden effects to 0.13 in the median of the samples' 207 small steps, 0.53 in nine of ten.
/// An element is named where another lowers the misfit of all small steps together to a quarter, from above 0.5 (a station off by one or five: from 0.7 to 1 down to 0.05).
/// A channel is late where a delay of 16 ms or more lowers it to a fifth; delays hidden in the samples are up to 12 ms, and are for `diagnose`. Costs 20 ms, for elements up to a second.
std::optional<Suspicion> other_element(const PlausibleCampaign& campaign);
std::vector<Suspicion> late_channels(const PlausibleCampaign& campaign);

}  // namespace unrig
