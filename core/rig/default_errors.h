#pragma once
#include "core/rig/givens.h"

namespace unrig {

/// What the numbers of a rig file are usually off by where it states no uncertainty. One standard deviation, in per cent of the number unless it says otherwise:
///
/// | numbers | each its own | in common |
/// | --- | --- | --- |
/// | masses, moments of inertia | 1 | 1 |
/// | stations | 0.25 % of the last station | - |
/// | mass centres, chord, pitch axis, length of a strip | 1 | - |
/// | gauge gains of a rig of modes | - | 1 |
///
/// The stiffness of a chain is a parameter of every fit, and so are mass, frequency and damping of a mode. Whatever the rig states is left out of account.
Givens usual_errors(const Rig& rig);

/// The same of a run's head and time column, errors that all runs of a campaign share: speed, density, calibration of gauge and force 1 %, clock 0.1 %.
Givens usual_errors(const Run& run);

}  // namespace unrig
