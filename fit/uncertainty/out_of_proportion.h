#pragma once
#include <string>
#include <vector>

#include "fit/fit.h"

namespace unrig {

/// Sentences on mount participations that no mode has. The ratio g/m of participation and modal mass is the mode's participation factor; it is 1.57, 0.87, 0.51 for the first modes of a uniform cantilever normalised at
/// its tip, and grows as the inverse of the shape at the station that normalises it. Told where it exceeds 10 by more than its standard error: that station moves less than about a tenth of the shape's largest displacement.
/// Source: R. D. Blevins, Formulas for Natural Frequency and Mode Shape (1979), table 8-1; participation factors from its shapes.
std::vector<std::string> out_of_proportion(const std::vector<FittedParameter>& parameters);

}  // namespace unrig
