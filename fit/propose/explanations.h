#pragma once
#include <string>
#include <vector>

#include "core/law/law.h"
#include "core/model/wagner.h"
#include "core/rig/rig.h"
#include "core/run/run.h"

namespace unrig {

/// One of several explanations of the same runs: effects of the list and laws, at work together.
struct Explanation {
  std::string name;                  ///< ids and formulas, joined by " + "
  std::vector<std::string> effects;  ///< ids of the list
  std::vector<Law> laws;
};

/// What a diagnosis leaves undecided, with rig and runs read from where it says they are.
struct Rivals {
  Rig rig;
  std::vector<Run> runs;
  Wagner circulation = Wagner::within_1e4;
  std::vector<Explanation> explanations;  ///< that of the diagnosis first
  std::vector<std::string> inputs;        ///< paths of rig and runs, as they were found
  std::vector<std::string> left_out;      ///< explanations that cannot be simulated, each with the reason
};

/// Out of diagnosis.json: `missing`, then each set of `equivalent`, and `missing` with a law in place of its rival. Rig and runs are looked for as the diagnosis names them, from the working
/// directory and from the folder of the diagnosis. Throws InputError where the file is no diagnosis, leaves nothing undecided, or rig or readings have changed since.
Rivals read_rivals(const std::string& path);

}  // namespace unrig
