#pragma once
#include "fit/likelihood/joint_problem.h"

namespace unrig {

/// Start values of a rig known as modes from the recordings themselves.
///
/// Frequencies: lines that stand out of the frequency response output over input (of free decays: of the output), averaged over three lines. Each mode takes, in turn and until
/// none changes, that of its own present frequency and of such lines within a factor of 1.5 of the file's, which leaves least of the readings; their order stays that of the file. Damping: a third of
/// the file's, the file's, three times it, likewise. Masses and participations with the initial state by linear least squares: a response is linear in 1/m and g/m.
///
/// `joint` at its start values; unknowns that are held stay. At most the first 16384 samples of a run are looked at. Returns whether anything moved.
bool start_modes_from_spectra(JointProblem& joint);

/// Lines of the frequency response of a run, strongest over their surroundings first [Hz].
std::vector<double> resonances(const RunResidual& run);

}  // namespace unrig
