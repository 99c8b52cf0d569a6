#pragma once
#include <string>
#include <string_view>

#include "core/import/recording.h"

namespace unrig {

/// Reads the datasets 58 (function at a nodal degree of freedom) of a universal file, as text and binary (58b, IEEE numbers in either byte order);
/// other datasets are skipped. Real ordinates in single and double precision, evenly spaced or each with its abscissa, which then becomes a channel
/// of its own, "NODE:DIRECTION abscissa". Complex functions and binary formats of DEC and IBM are left out with a warning.
///
/// Channels are called "NODE:DIRECTION" of the response, "3:+Z", or where both are 0, as amplifiers have it, by the label of the ordinate, or by the dataset's first line where that is "NONE"
/// too; a name that occurs again gets "#2" behind it. The unit is the label of the ordinate's unit, empty for "NONE".
/// Throws InputError, with the line, for a dataset that is cut off or not as it says. Source: SDRC universal file datasets, 58; UC-SDRL's 58b.
Recording read_uff(std::string_view bytes, const std::string& file);

}  // namespace unrig
