#pragma once
#include "core/effects/effect.h"

namespace unrig {

// One function per file in core/effects/.
Effect higher_mode();
Effect cubic_stiffness();
Effect coulomb_friction();
Effect freeplay();
Effect quadratic_drag();
Effect wagner_lag();
Effect separation_lag();
Effect lift_curve();
Effect vortex_shedding();
Effect tank_wave();
Effect carriage_vibration();
Effect gauge_lowpass();
Effect torsion_crosstalk();
Effect gauge_drift();
Effect mains_hum();
Effect channel_delay();
Effect twist_stiffness();
Effect elastic_coupling();
Effect bouc_wen();
Effect cubic_damping();
Effect speed_surge();
Effect filling_mass();

}  // namespace unrig
