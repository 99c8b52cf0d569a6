#pragma once
#include <string>
#include <vector>

#include "core/check/gate.h"
#include "core/files/provenance.h"
#include "fit/check/foreseen.h"
#include "fit/check/summary.h"

namespace unrig {

/// What `unrig check` found.
struct Checked {
  std::string rig_file;
  RigSummary rig;
  std::vector<RunSummary> runs;
  std::vector<Suspicion> suspicions;
  std::vector<Foreseen> foreseen;
  std::string not_foreseen;  ///< why nothing was foreseen; empty: it was, or there are no runs
  Provenance made;
};

/// check.json (correct/manual/check.md), units beside the numbers.
std::string to_json(const Checked& checked);

/// For people.
std::string report(const Checked& checked);

}  // namespace unrig
