#pragma once
#include "correct/correct.h"

namespace unrig {

/// The gate (core/check/gate.h) before a correction: the run against the rig as stiff as it was fitted. A fit of another rig is left to refuse_other_rig.
void pass_the_gate(const CorrectProblem& problem, bool anyway);

}  // namespace unrig
