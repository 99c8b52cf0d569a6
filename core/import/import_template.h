#pragma once
#include <string>

#include "core/import/recording.h"

namespace unrig {

/// A mapping of this recording to begin with (core/import/import.h): every channel that numbers allow, with its range, named by its unit and name as far as these tell, and `# ?`
/// before what only its user knows. It imports as it stands. Conditions stand in it as examples; a unit that the file does not give is asked for, and a gauge
/// without one is taken to be in volts, which no command takes for newtons.
std::string import_template(const Recording& recording);

}  // namespace unrig
