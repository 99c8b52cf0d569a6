#pragma once
#include "fit/search/effect_search.h"

namespace unrig {

/// A nonlinear fit that explains most runs and leaves one far from its noise, once more with theta as the other runs have it and the one followed from afar there. The fit as it was where that does not take half of
/// what it leaves. A search among trajectories ends in one of many least chi-squares; runs that are followed tell theta, and with it which.
Trial with_lost_runs_followed(const Trial& trial);

}  // namespace unrig
