#pragma once
#include <Eigen/Core>
#include <string>
#include <vector>

#include "correct/segments/run_in_legs.h"

namespace unrig {

/// Throws NoAnswer where the trajectory that was estimated at theta takes a law beyond the range that it was learnt on; with `go_on` that is a warning. A run in several legs is not looked at: said among the warnings.
void refuse_beyond_learnt(const RunInLegs& legs, const Eigen::VectorXd& theta, bool go_on, std::vector<std::string>& warnings);

/// For a run whose trajectory is not held against where the laws were learnt. Only laws that are masses act in such a run.
void warn_of_laws_unheeded(const AeroelasticModel& model, const Run& run, std::vector<std::string>& warnings);

}  // namespace unrig
