#pragma once
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/files/provenance.h"

namespace unrig {

/// What the head of a simulated run says of how it was made, in lines that readers of runs skip.
struct SimulatedRun {
  std::string of_run;               ///< the run file that was simulated
  std::vector<std::string> recipe;  ///< rig, parameters, loads
  MadeBy made_by = {};

  std::vector<std::string> remarks() const;
};

/// Out of the text of a run file; nothing where `unrig simulate` did not write it.
std::optional<SimulatedRun> simulated_run(std::string_view text);

}  // namespace unrig
