#pragma once
#include <string>
#include <vector>

#include "core/files/provenance.h"
#include "core/files/together.h"
#include "fit/propose/propose.h"

namespace unrig {

/// Where a plan came from and where it goes.
struct PlanPaths {
  std::string diagnosis, rig, limits, plan;
  std::size_t runs = 0;  ///< as many motion files at most

  /// Path of motion file k, from 0: plan.toml -> plan_1.csv.
  std::string motion(std::size_t k) const;
};

/// plan.toml and the motion files of its best runs (correct/manual/propose.md).
std::vector<TextFile> plan_files(const Plan& plan, const PlanPaths& paths, const Provenance& made);

/// "plan_1.csv decides", "no run within your limits decides", or what is not known.
std::string verdict_of(const Plan& plan, const Comparison& comparison, const PlanPaths& paths);

/// For a person.
std::string report(const Plan& plan, const PlanPaths& paths);

}  // namespace unrig
