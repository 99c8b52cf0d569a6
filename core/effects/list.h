#pragma once
#include "core/effects/effect.h"

namespace unrig {

// One function per file in core/effects/.
Effect tank_wave();
Effect gauge_lowpass();
Effect torsion_crosstalk();
Effect gauge_drift();
Effect mains_hum();

}  // namespace unrig
