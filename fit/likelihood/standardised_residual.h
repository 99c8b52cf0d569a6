#pragma once
#include <Eigen/Core>

#include "fit/likelihood/run_residual.h"

namespace unrig {

/// The residual of fitted channel `channel` of a run at theta, as predicted there, in units of its noise, untempered; 0 where left out.
Eigen::VectorXd standardised_residual(const RunResidual& run, const Eigen::VectorXd& theta, const RunResidual::Prediction& prediction, std::size_t channel);

}  // namespace unrig
