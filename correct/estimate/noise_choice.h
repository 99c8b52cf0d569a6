#pragma once
#include <vector>

#include "correct/estimate/prior.h"
#include "correct/segments/run_in_legs.h"

namespace unrig {

/// Gives the noise of a run in one leg, white so far, the colour that makes its readings most probable, and goes on with the search from there: white, what the fit's runs have in common in
/// this run's size (`expected`), or the run's own, whose powers cost ln(readings) each in twice the logarithm of the evidence (G. Schwarz, Ann. Statist. 6 (1978) 461).
///
/// What is left of a run lacks some of the slow noise, which offset and load took: of a run alone, bands in 1/f noise are too narrow (tests/studies/COLOURED_NOISE.md). Steps along the
/// evidence, power by power, were no better in 72 runs and took seconds. `enough`: of chi-square, for the search.
void choose_colour(RunInLegs& legs, Search& search, const std::vector<ChannelColour>& expected, double enough);

}  // namespace unrig
