#pragma once
#include <Eigen/Core>
#include <string>
#include <vector>

#include "fit/run_residual.h"

namespace unrig {

/// Whether a residual is white, and what its colour does to the uncertainty of the parameters.
///
/// The usual covariance H^-1 (H = J^T J, J the Jacobian with linear unknowns following theta, all in units of the noise) holds for white residuals.
/// Residuals of real recordings are coloured, and it then is several times too small (Morelli and Klein, J. Aircraft 34 (1997) 775). With
/// the residual's own spectrum S(f), for each channel by itself,
///
///   cov(theta) = H^-1 (J^T Sigma J) H^-1,   J^T Sigma J = (1/n) sum_f S(f) conj(J^(f)) J^(f)^T
///
/// S is the periodogram of the residual, averaged over seven neighbouring lines, 1 for white noise of the assumed level; or the spectrum of an
/// autoregression fitted to the residual, where that is more. The first sees lines as narrow as a resonance, but just there the fit has taken part
/// of the noise into its parameters; the second makes up for that. Coverage: tests/studies/COVERAGE.md.

/// J^T Sigma J of one run over all model parameters (P x P).
Eigen::MatrixXd coloured_information(const RunResidual::Sensitivity& sensitivity);

/// S at frequency zero, where a constant offset sees the noise: likewise, over the lowest seven lines without the mean itself, which the offset took.
double power_at_zero(const Eigen::VectorXd& residual);

/// Probability that white noise looks at least as coloured: Bartlett's test of the cumulative periodogram (Kolmogorov-Smirnov), for the
/// most coloured of the channels, times the number of channels.
double whiteness(const RunResidual::Sensitivity& sensitivity);

}  // namespace unrig
