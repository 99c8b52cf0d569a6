#pragma once
#include <optional>
#include <string>

#include "fit/search/arrival.h"

namespace unrig {

/// A recording that would tell two explanations of the same runs from each other.
struct SeparatingRecording {
  std::string what;       ///< "step_a.csv with a step three times as large"
  double difference = 0;  ///< r.m.s. between the two predictions of the gauge, over its noise
  double now = 0;         ///< the same for the run as it was recorded
};

/// Simulates variations of the runs (other speeds, larger and faster steps, stronger plucks, the other medium) with both fits, and gives the one in which the gauge would
/// differ most; its own zero is left out. What signals from outside (waves, hum) would do is not known and is left out too. None where no variation differs
/// by more than the noise and by more than twice of what the run itself does, or the rig has no gauge that a simulation could read.
std::optional<SeparatingRecording> separating_recording(const Arrival& one, const Arrival& other);

}  // namespace unrig
