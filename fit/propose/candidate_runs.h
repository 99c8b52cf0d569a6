#pragma once
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "core/rig/rig.h"
#include "core/run/run.h"
#include "fit/propose/limits.h"

namespace unrig {

/// A run that could be recorded.
struct CandidateRun {
  std::string what;                    ///< "free decay in water, released from 40 N"
  Run run;                             ///< conditions and inputs, no readings; of a repeat the recording itself
  std::optional<double> release_load;  ///< N, of a free decay
  std::size_t like = 0;                ///< run at hand whose noise, sampling and own parameters it is taken to have
  double angle_noise = 0;              ///< rad, of a turn, where the run that it is like has none
  bool repeat = false;                 ///< that run over again
};

/// Runs within the limits: free decays from several loads, turns of the shaft at several speeds and rates, sweeps of a measured force, in each medium; then every run at hand over again.
/// Rigs of modes have no turns. Throws InputError where the limits leave none, or ask for turns and nothing says how noisy the angle is.
std::vector<CandidateRun> candidate_runs(const Limits& limits, const Rig& rig, const std::vector<Run>& runs);

}  // namespace unrig
