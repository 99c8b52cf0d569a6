#pragma once
#include <functional>

#include "fit/search/effect_search.h"

namespace unrig {

/// Gives each run noise of the colour that is left of all of them at rest (noise_colours), in its own size, and fits again. False, and nothing done, where that is white.
bool take_noise_colour(Trial& trial);
/// The same with the colour that is left of most of them (noise_colours_of_most), in the size that it has there beside white noise: a mismatch in the others makes it no larger.
bool take_noise_colour_of_most(Trial& trial);
/// Whether the noise of any run has a colour.
bool has_colour(const JointProblem& joint);
/// Gives the runs of `trial` the noise of those of `other`, and fits again, where that has a colour.
void take_noise_of(Trial& trial, const Trial& other);

/// A search in the noise that the decays are left with, where that has a colour: how far a run is followed is told in units of it. The noise is as it was behind the search.
void in_noise_of_decays(Trial& trial, const std::function<void()>& search);

}  // namespace unrig
