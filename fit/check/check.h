#pragma once
#include "fit/check/check_files.h"

namespace unrig {

/// What `unrig check` does: a look at the rig, at each run, at what cannot be right (core/check/gate.h), and, where nothing is grave, at what a fit could say (foreseen.h).
Checked check(const Rig& rig, const std::vector<Run>& runs);

/// Whether no answer from such input can be trusted.
bool any_grave(const std::vector<Suspicion>& suspicions);

}  // namespace unrig
