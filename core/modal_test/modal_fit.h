#pragma once
#include <Eigen/Core>
#include <vector>

#include "core/modal_test/frequency_response.h"

namespace unrig {

/// A mode out of frequency response functions. Residues are real: the mode moves as the undamped one does.
struct FittedMode {
  double frequency = 0;       ///< Hz, undamped
  double damping_ratio = 0;
  Eigen::VectorXd residue;    ///< of each function, shape at the response over the mass for the force: [response unit/(N s^2)], of motions as displacement
};

/// Modes of all functions together by weighted least squares, with the covariance of (frequency, damping ratio, residues) mode by mode:
///
///   H_j(f) = (i w)^p [ sum_k r_jk / (w_k^2 - w^2 + 2 i zeta_k w_k w) + u_j - l_j / w^2 ],   w = 2 pi f
///
/// with p = 0 of displacements and gauges, 1 of velocities, 2 of accelerations; u and l stand for modes far above and below, poles outside of the band for near ones. Real and imaginary part of a line have the standard deviation
///
///   |H| sqrt((1 - g^2) / (2 (n - 1) g^2))
///
/// of coherence g^2, estimated from the same n averages, where it was measured (J. S. Bendat and A. G. Piersol, Random Data, on errors of frequency response estimates; n - 1 for n, since the estimate of g^2 is too high by that).
/// Its square is the mean over five lines. Else it is one for all lines, in each function what it leaves. All are then scaled so that the reduced chi-square is one, but never below what n averages say. Lines count as independent.
struct ModalFit {
  std::vector<FittedMode> modes;         ///< ascending
  Eigen::MatrixXd covariance;            ///< of modes x (frequency, damping ratio, residues)
  Eigen::Index outside = 0;              ///< poles outside of the band, which are none of `modes`
  double reduced_chi2 = 0;               ///< with `averages` as given; 0 where the weights are only relative
  std::vector<double> share_left;        ///< r.m.s. of what is left of each function, over its r.m.s.
  Eigen::Index place(std::size_t mode) const { return static_cast<Eigen::Index>(mode) * (2 + modes.front().residue.size()); }
};

struct ModalFitOptions {
  int modes = 0;     ///< how many; 0: as many as Bayes's criterion (BIC) wants, up to 12, of which a residue is five standard deviations from 0
  int averages = 0;  ///< blows that were averaged; 0: not known
};

/// Throws NoAnswer where no mode is found, or fewer than were asked for.
ModalFit fit_modes(const std::vector<FrequencyResponse>& functions, const ModalFitOptions& options);

}  // namespace unrig
