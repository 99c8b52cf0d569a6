#pragma once
#include "fit/uncertainty/undetermined.h"

namespace unrig {

/// Resonances that the noise drowns. Where the trace of a mode is no larger than the lines of the noise, chi-square has many minima along the mode's stiffness and damping, one at each
/// line that resembles it, and the curvature of any of them looks like a small error (the threshold effect of frequency estimation: D. C. Rife and R. R. Boorstyn, IEEE Transactions on
/// Information Theory 20, 591, 1974). What tells them apart is how much chi-square rises when the resonance is taken elsewhere: by the energy of a trace that is
/// there, over the noise. Where another stiffness between half and twice the one found, with the damping found or the one to start from and all else at its least, raises it by less than
/// 25 (five standard deviations) and less than a quarter of what the curvature promised (which has to be 16 or more), stiffness and damping of these modes go back to their start values
/// and are held. Returns whether any was held.
bool hold_unheard(JointProblem& joint, const ParameterUncertainty& uncertainty, const StartValues& starts);

}  // namespace unrig
