#pragma once
#include <complex>
#include <string>
#include <string_view>
#include <vector>

#include "core/import/recording.h"

namespace unrig {

/// Reads the datasets 58 (function at a nodal degree of freedom) of a universal file, as text and binary (58b, IEEE numbers in either byte order);
/// other datasets are skipped. Real ordinates in single and double precision, evenly spaced or each with its abscissa, which then becomes a channel
/// of its own, "NODE:DIRECTION abscissa". Complex functions (read_uff_functions has them) and binary formats of DEC and IBM are left out with a warning.
///
/// Channels are called "NODE:DIRECTION" of the response, "3:+Z", or where both are 0, as amplifiers have it, by the label of the ordinate, or by the dataset's first line where that is "NONE"
/// too; a name that occurs again gets "#2" behind it. The unit is the label of the ordinate's unit, empty for "NONE".
/// Throws InputError, with the line, for a dataset that is cut off or not as it says. Source: SDRC universal file datasets, 58; UC-SDRL's 58b.
Recording read_uff(std::string_view bytes, const std::string& file);

/// One dataset 58 as it stands in the file: real or complex, over time or frequency.
struct UffFunction {
  int type = 0;                 ///< 1 time response, 4 frequency response function, 6 coherence, and so on
  int line = 0;                 ///< of the file, where it ends
  int node = 0, direction = 0;  ///< of the response; directions 1 to 6 are +X to +RZ, negative ones point the other way
  int reference_node = 0, reference_direction = 0;
  std::string name;             ///< as read_uff calls it
  std::string unit, reference_unit;  ///< labels of ordinate and denominator; empty for "NONE"
  std::vector<double> abscissa;
  std::vector<std::complex<double>> value;
};

/// All datasets 58 of a universal file, in their order; those in DEC and IBM formats are left out. Throws as read_uff does; an empty list where there is none.
std::vector<UffFunction> read_uff_functions(std::string_view bytes, const std::string& file);

}  // namespace unrig
