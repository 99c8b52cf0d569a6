#pragma once
#include <Eigen/Core>
#include <utility>
#include <vector>

#include "core/model/rigid_load.h"
#include "correct/segments/run_in_legs.h"

namespace unrig {

/// Load per reading where it is spread evenly over the strips, which the gauge feels.
double steady_per_reading(const Rig& rig);

/// Loads of the rigid rig at theta and c of a leg that goes on `from` the one before, steady load included, and how they move at `at`.
RigidLoad load_at(const RunResidual& residual, const Eigen::VectorXd& theta, const Eigen::VectorXd& c, const std::vector<Eigen::Index>& at, const RigidLoad::State& from);

/// The circulatory and the whole load over the record, at theta and the legs' c.
std::pair<Eigen::VectorXd, Eigen::VectorXd> loads_at(const RunInLegs& legs, const Eigen::VectorXd& theta, const std::vector<Eigen::VectorXd>& c);

}  // namespace unrig
