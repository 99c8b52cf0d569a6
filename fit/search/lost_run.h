#pragma once
#include "fit/search/effect_search.h"

namespace unrig {

/// Of a nonlinear fit that explains most runs and leaves one far from its noise: what it leaves where theta is that of the other runs, and the run is followed from afar there. A search among trajectories ends in one of many least
/// chi-squares; runs that are followed tell theta, and with it which. The fit itself where that leaves less than half as much of no run.
Trial with_lost_runs_followed(Trial trial);

}  // namespace unrig
