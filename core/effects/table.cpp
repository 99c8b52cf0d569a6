#include <stdexcept>

#include "core/effects/effect.h"
#include "core/effects/list.h"

namespace unrig {

const std::vector<Effect>& effects() {
  static const std::vector<Effect> table{
      tank_wave(),
      gauge_lowpass(),
      torsion_crosstalk(),
      gauge_drift(),
      mains_hum(),
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
