#pragma once
#include <functional>

#include "fit/search/effect_search.h"

namespace unrig {

/// Levels of the runs' white noise from what the fit leaves, where that is less (RunResidual::settle_noise).
void settle_noise(JointProblem& joint);

/// Gives each run noise of the colour that is left of all of them at rest (noise_colours), in its own size, and fits again, the levels of white noise settled first (RunResidual::settle_noise). False where what is left is white.
bool take_noise_colour(Trial& trial);
/// The same with the colour that is left of most of them (noise_colours_of_most), in the size that it has there beside white noise: a mismatch in the others makes it no larger.
bool take_noise_colour_of_most(Trial& trial);
/// Whether the noise of any run has a colour.
bool has_colour(const JointProblem& joint);
/// Gives the runs of `trial` the noise of those of `other`, and fits again, where that has a colour.
void take_noise_of(Trial& trial, const Trial& other);

/// Levels of the runs' noise that were told with tones in the readings, which differences take for noise: those that are left `without_tones`, and `trial` fitted again. Nothing where none is lower.
void take_levels_of(Trial& trial, Trial without_tones);

/// A search in the noise that the decays are left with, where that has a colour: how far a run is followed is told in units of it. The noise is as it was behind the search.
void in_noise_of_decays(Trial& trial, const std::function<void()>& search);

}  // namespace unrig
