#pragma once
#include "fit/likelihood/joint_problem.h"

namespace unrig {

/// Which mode is which, on a rig that is known only as modes. The gauge reads sum_i g_i F / (m_i s^2 + c_i s + k_i): modes a and b may change places, m_a' / g_a = m_b / g_b
/// and likewise for c and k, without any reading noticing, so that a search from afar ends with either numbering. The rig file's numbers are those of its frequencies:
/// the fitted modes, by rising k / m, take the numbers that the rig file's have by theirs. A mass that is held stays, and c and k go with it. Modes whose gains differ in sign
/// cannot change places. Returns whether any did.
bool number_modes_by_frequency(JointProblem& joint);

}  // namespace unrig
