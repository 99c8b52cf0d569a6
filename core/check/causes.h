#pragma once
#include <functional>
#include <string>
#include <vector>

#include "core/rig/rig.h"
#include "core/run/run.h"

namespace unrig {

/// A slip that people make: what is said of it, and how it is undone.
struct Cause {
  std::string says;   ///< what was found, with the factor, {} the others: "the gauge reads 4.448 times what {} say"
  std::string words;  ///< the likely cause, a question: "are they newtons, and the column is labelled lbf?"
  double factor = 1;  ///< given over true; -1 a sign
  double price = 0;   ///< how much less likely it is than the others, in units of chi-square
};

struct RunCause : Cause {
  std::function<bool(const Run&)> possible;  ///< whether such a run can have it
  std::function<void(Run&)> undo;
};

struct RigCause : Cause {
  std::function<bool(const Rig&)> possible;
  std::function<void(Rig&)> undo;
};

/// Slips in one recording or in all: units, signs, columns, clock, speed, density.
const std::vector<RunCause>& run_causes();

/// Slips in the rig file.
const std::vector<RigCause>& rig_causes();

}  // namespace unrig
