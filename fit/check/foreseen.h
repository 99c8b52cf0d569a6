#pragma once
#include <string>
#include <vector>

#include "core/rig/rig.h"
#include "core/run/run.h"

namespace unrig {

/// What a fit of these runs could say of one parameter.
struct Foreseen {
  std::string name, unit;
  std::string run;         ///< file; empty where all runs share it
  double value = 0;        ///< where it was linearised
  double std_error = 0;    ///< one standard deviation that white noise would leave; NaN where it is not determined
  bool determined = true;  ///< better than half of itself
  std::string advice;      ///< where it is not: why, and what to record
};

/// Linearised at the rig file's values, stiffness at the strongest line of the free decays: the information matrix of the recordings in units of their own noise, motion and offsets
/// eliminated. Costs one evaluation of the fit's model. Throws as `fit` does for runs that are none of this rig.
std::vector<Foreseen> foresee(const Rig& rig, const std::vector<Run>& runs);

}  // namespace unrig
