#pragma once
#include <optional>
#include <string>
#include <vector>

#include "core/files/provenance.h"
#include "core/model/simulate.h"
#include "fit/fit_files.h"

namespace unrig {

/// What `unrig simulate` can be told beside rig, run and fit; `output` is the command line's alone.
struct SimulateOptions {
  std::string rig, run, fit, output, circulation, indicial, release_load;
  Eigen::Index normal_modes = 0, torsion_modes = 0;
  std::vector<std::string> settings, laws;
  bool jumps = false, as_recorded = false, beyond = false;
};

struct ToSimulate {
  SimulateProblem problem;
  MadeBy made_by;
};

/// The problem that rig, run, an optional fit and the options state. Of `options` the paths of rig, run and fit are not read: they name them in messages.
ToSimulate simulate_problem(Rig rig, Run run, const std::optional<FittedRig>& fit, const SimulateOptions& options, const Provenance& made);

/// What is simulated. Throws NoAnswer where a law goes beyond the range that it was learnt on; with SimulateOptions::beyond that is a warning.
SimulateResult simulate_within(const SimulateProblem& problem, const SimulateOptions& options);

}  // namespace unrig
