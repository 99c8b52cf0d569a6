#include "core/effects/list.h"

namespace unrig {

/// Structural modes that the rig file left out: all that its flexibility matrices hold below the Nyquist frequency, and as many more as the frequencies in
/// the fluid need, in place of the number in `normal.modes`. Stiffness scale and damping ratio of the chain hold for them too, so that it has no parameters.
/// Source: seed, Eq. 3.3-3.4 and section 4.2.3 (what one normal mode leaves near 15 Hz).
Effect higher_mode() {
  Effect e;
  e.id = "higher-mode";
  e.summary = "structural modes that the model left out";
  e.equation = "x'' + 2 zeta omega_k x' + omega_k^2 x = phi_k^T F for every k";
  e.source = "seed, Eq. 3.3-3.4 and section 4.2.3";
  e.starts = {Eigen::VectorXd(0)};
  e.acts = [](const Conditions&) { return true; };
  e.apply = [](LinearSystem&, const EffectContext&) {};  // a model with this effect is made with a richer basis (fit/model_of)
  e.needs = Needs::beam;
  return e;
}

}  // namespace unrig
