#pragma once
#include <string>
#include <vector>

#include "core/effects/effect.h"
#include "core/model/wagner.h"
#include "core/rig/rig.h"
#include "core/rig/structure.h"
#include "tests/support/sample_data.h"

// Every effect of the table on every rig that it can act on, in a run that wakes all of them.

namespace unrig::effect_cases {

/// The seed's rig with a sensor of the twist, and one known as two modes.
inline Rig beam() {
  Rig rig = read_rig(test::null_campaign("rig.toml"));
  rig.normal.modes = 3;
  rig.sensors.push_back({"twist", SensorKind::twist, 14, 1, "rad"});
  return rig;
}

inline Rig two_modes() {
  Rig rig;
  rig.file = "modes.toml";
  rig.modal = {{2, 3, 0.01, 1000, "N"}, {0.5, 11, 0.02, 700, "N"}};
  return rig;
}

inline AeroelasticModel model_with(const Rig& rig, const std::string& id) {
  const Basis basis = rig.is_modal() ? Basis{} : make_basis(rig, Eigen::Index{3}, Eigen::Index{1});
  return AeroelasticModel(rig, basis, wagner(Wagner::jones)).with_effects({id});
}

/// A stalled run in water, so that every effect acts, which records all that can drive it.
inline Conditions conditions_for(const Rig& rig) {
  Conditions c;
  c.density = 998.2;
  c.force = c.mount = true;
  c.nyquist = 250;
  if (rig.is_modal()) return c;
  c.speed = 0.6;
  c.prescribed_pitch = true;
  c.onset_angle = 0.44;
  return c;
}

/// Every effect on every rig that it can act on.
struct Case {
  const Effect* effect;
  Rig rig;
};
inline std::vector<Case> cases() {
  std::vector<Case> all;
  for (const Rig& rig : {beam(), two_modes()})
    for (const Effect& e : effects())
      if (has(rig, e.needs)) all.push_back({&e, rig});
  return all;
}

}  // namespace unrig::effect_cases
