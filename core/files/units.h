#pragma once
#include <string>
#include <string_view>

#include "core/files/error.h"

namespace unrig {

/// A linear map from a unit of a file to SI: `si = factor * value + offset` (offset 0 for all but scales like degC).
struct UnitScale {
  double factor = 1;
  double offset = 0;
  double operator()(double value) const { return factor * value + offset; }
};

/// Scale from `unit` to the unit `si` (SI base units and radians: "m", "N", "rad", "kg.m^2", "m/N", "1" ...), by UDUNITS-2 with the
/// aliases `deg`, `lbm`, `lb` (pound mass), and volt gains such as `lbf/V`.
///
/// Radian counts as dimensionless, as in UDUNITS, but for two traps: counts are no angle, and an angle per time that stands for a frequency
/// ("rad/s", "rpm" where "Hz" is wanted) is divided by 2 pi. Reciprocals ("s" for "Hz"), which UDUNITS converts, are errors.
/// Throws InputError naming `place`, `what` (key or column), the unit found and the dimension wanted. Safe to call from several threads.
UnitScale unit_scale(std::string_view unit, std::string_view si, const InputError::Place& place, std::string_view what);

/// A number and its unit as they stand in a file.
struct Measure {
  double value = 0;
  std::string unit;
};

/// "4.4 N/V" -> 4.4 and "N/V". Throws InputError where there is no finite number, no unit, or a second number before the unit.
Measure split_quantity(std::string_view text, const InputError::Place& place, std::string_view what);

/// "4.4 N/V" -> value in the SI unit `si`. Throws InputError where there is no number, no unit, or the wrong dimension.
double quantity(std::string_view text, std::string_view si, const InputError::Place& place, std::string_view what);

/// The SI unit, as text, in which the program keeps a quantity given in `unit` ("N" for lbf, "rad" for deg, "N.m" for lbf.in, "V" for mV).
/// Throws InputError for a unit that UDUNITS does not know, and for calendar and logarithmic ones.
std::string si_unit(std::string_view unit, const InputError::Place& place, std::string_view what);

}  // namespace unrig
