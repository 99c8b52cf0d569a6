#pragma once
#include <Eigen/Core>

#include "fit/likelihood/run_residual.h"

namespace unrig {

/// The residual of fitted channel `channel` of a run in units of its noise, untempered; 0 where left out.
Eigen::VectorXd standardised_residual(const RunResidual& run, const RunResidual::Prediction& prediction, std::size_t channel);

}  // namespace unrig
