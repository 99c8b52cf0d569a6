#pragma once
#include <Eigen/Core>

#include "core/model/aeroelastic_model.h"

namespace unrig {

/// States that stay where they are under a constant column b of drive: x = -A^-1 b over the free and the settling states, all others 0. Laws are taken for zero.
Eigen::VectorXd static_state(const LinearSystem& system, const Eigen::VectorXd& drive);

}  // namespace unrig
