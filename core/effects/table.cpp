#include <stdexcept>

#include "core/effects/effect.h"
#include "core/effects/list.h"

namespace unrig {

const std::vector<Effect>& effects() {
  static const std::vector<Effect> table{
      higher_mode(),
      cubic_stiffness(),
      coulomb_friction(),
      freeplay(),
      quadratic_drag(),
      wagner_lag(),
      separation_lag(),
      lift_curve(),
      vortex_shedding(),
      tank_wave(),
      carriage_vibration(),
      gauge_lowpass(),
      torsion_crosstalk(),
      gauge_drift(),
      mains_hum(),
      channel_delay(),
      twist_stiffness(),
      elastic_coupling(),
      bouc_wen(),
      cubic_damping(),
      speed_surge(),
      filling_mass(),
  };
  return table;
}

const Effect& effect(const std::string& id) {
  std::string choices;
  for (const Effect& e : effects()) {
    if (e.id == id) return e;
    choices += (choices.empty() ? "" : ", ") + e.id;
  }
  throw std::invalid_argument("no effect '" + id + "'; there are: " + choices);
}

}  // namespace unrig
