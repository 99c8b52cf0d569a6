#pragma once
#include <Eigen/Core>

namespace unrig {

/// How the power that is left of a channel is spread over frequency, beyond white noise: densities in octaves, one-sided.
///
/// The octaves hold the lines 1, 2 to 3, 4 to 7 of the record's transform, up to half the sampling rate. Over the whole range the densities integrate to the variance.
struct LeftInOctaves {
  double from = 0;          ///< lower edge of the first octave, one over the length of the record [Hz]
  Eigen::VectorXd density;  ///< [square of the channel's unit per Hz], 0 or above

  /// At a frequency [Hz]: that of the octave it lies in, of the first one below it, of the last one above. 0 where there are none.
  double at(double frequency) const;
};

/// Of a residual `dt` [s] apart whose white noise has the standard deviation `noise`; samples with no `weight` have no residual. No octaves where fewer than 8 count, or one is not finite
/// (a model that runs away).
///
///   S_b = max(0, mean over the octave of 2 dt |F_k|^2 / m - 2 dt noise^2),   F the transform with 0 where nothing is left, m the samples that count.
///
/// Averaged periodogram: M. S. Bartlett, Biometrika 37 (1950) 1.
LeftInOctaves left_in_octaves(const Eigen::VectorXd& residual, const Eigen::VectorXd& weight, double dt, double noise);

}  // namespace unrig
