#pragma once
#include <Eigen/Core>

#include "fit/likelihood/run_residual.h"

namespace unrig {

/// What is left of the fitted readings of a run at theta (samples x channels, SI), untempered, in units of its noise. It is white where it is that: noise of measured inputs rings like the rig
/// (fit/likelihood/input_noise.h). 0 where a reading is left out.
Eigen::MatrixXd standardised_readings(const RunResidual& run, const Eigen::VectorXd& theta, const Eigen::MatrixXd& left);

/// Root mean square of what the noise of the measured inputs does to a channel [SI] at theta, its level as last settled (RunResidual::settle_noise); 0 where the inputs count as exact.
double sigma_of_inputs(const RunResidual& run, const Eigen::VectorXd& theta, std::size_t channel);

/// Of a run in which a force wanders: weights its innovations by the root of the variance that the model at theta gives them (fit/likelihood/wandering_force.h). Others are left alone.
void settle_wandering(RunResidual& run, const Eigen::VectorXd& theta);

}  // namespace unrig
