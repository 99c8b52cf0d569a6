#pragma once
#include <cstddef>
#include <string>

#include "fit/search/arrival.h"

namespace unrig {

/// What a fit leaves of a run that it has not seen.
struct HeldoutResidual {
  std::string channel;
  double rms = 0, noise = 0;  ///< of the first fitted channel, in its unit
};

/// Predicts `run` with all shared parameters held where `arrival` left them. What belongs to the run alone is its own: motion, initial state, zero, lift slope and
/// the amplitudes of the effects' signals.
HeldoutResidual predict_heldout(const Arrival& arrival, const Run& run);

/// What the fit without one of its runs, from where it stands, leaves of that run. What belongs to the run alone is fitted from where the fit of all has it: its start, not its value, is known.
HeldoutResidual predict_left_out(const Arrival& arrival, std::size_t run);

}  // namespace unrig
