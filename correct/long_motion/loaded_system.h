#pragma once
#include <Eigen/Core>
#include <string>
#include <vector>

#include "core/model/aeroelastic_model.h"
#include "core/propagate/response.h"

namespace unrig {

/// The rig's model with the loads of a rigid rig (core/model/rigid_system.h) beside its own outputs: its states, then the lags of a rigid section that makes the same motion; outputs
/// `channels`, circulatory, normal_force. With exact partials.
LinearSystem loaded_system(const AeroelasticModel& model, const Conditions& conditions, const Eigen::VectorXd& theta, const std::vector<std::string>& channels);

/// The same with the partials of these parameters only.
LinearSystem with_partials_of(LinearSystem system, const std::vector<Eigen::Index>& parameters);
ExactStep with_partials_of(ExactStep step, const std::vector<Eigen::Index>& parameters);

/// What a unit cubic B-spline of the motion that begins at sample 0 does to all outputs (core/run/motion.h), with the partials of the parameters asked for (those that do not act stay empty).
Response spline_response(const LinearSystem& system, const ExactStep& step, Eigen::Index samples, const std::vector<Eigen::Index>& parameters);

}  // namespace unrig
