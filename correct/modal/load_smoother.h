#pragma once
#include <Eigen/Core>
#include <vector>

#include "core/propagate/exact_step.h"

namespace unrig {

/// A linear system whose last two states are an unknown load and its rate, l'' white noise of density `roughness` times the variance of the reading's noise:
/// x_(k+1) = transition x_k + known_k, reading_k = observe x_k + noise.
struct LoadModel {
  Eigen::MatrixXd transition, diffusion;  ///< covariance that a step adds, for a density of one
  Eigen::RowVectorXd observe;
  Eigen::VectorXd start_scale;            ///< size of each state; the start is unknown by a thousand times that
};

struct SmoothedLoad {
  Eigen::VectorXd load;
  Eigen::VectorXd variance;       ///< in units of the noise's variance
  Eigen::VectorXd angular_speed;  ///< of the error's direction on the unit sphere, per second (for the simultaneous band)
};

/// How probable readings are (NaN: missing): the logarithm of the likelihood with the noise's variance at its best, which is `noise_variance`.
struct LoadLikelihood {
  double logarithm = 0, noise_variance = 0;
};
LoadLikelihood likelihood(const LoadModel& model, double roughness, const Eigen::Ref<const Eigen::VectorXd>& reading);

/// The load's mean and variance for given readings.
SmoothedLoad smooth(const LoadModel& model, double roughness, const Eigen::VectorXd& reading);

}  // namespace unrig
