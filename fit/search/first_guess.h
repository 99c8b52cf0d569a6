#pragma once
#include "fit/likelihood/joint_problem.h"

namespace unrig {

/// Stiffness from spectra, before anything is fitted: the strongest line in each free decay is the rig's lowest mode.
///
/// Beam rigs: both stiffness scales become the median over the free decays of (f_line / f_model)^2, f_model the lowest coupled frequency in that
/// run's fluid (a wrong Young's modulus moves both). Modal rigs with one mode: its stiffness. Rigs without a gauge, or without a free decay,
/// keep what they have. Unknowns that are held, or not at the model's start value, are left alone.
void guess_from_spectra(JointProblem& joint);

}  // namespace unrig
