#pragma once
#include <Eigen/Core>
#include <string>
#include <vector>

#include "fit/likelihood/run_residual.h"

namespace unrig {

/// Whether a residual is white, and what its colour does to the uncertainty of the parameters.
///
/// The usual covariance H^-1 (H = J^T J, J the Jacobian with linear unknowns following theta, all in units of the noise) holds for white residuals.
/// Residuals of real recordings are coloured, and it then is several times too small (Morelli and Klein, J. Aircraft 34 (1997) 775). With
/// the residual's own spectrum S(f), for each channel by itself,
///
///   cov(theta) = H^-1 (J^T Sigma J) H^-1 = (1/n) sum_f S(f) conj(G(f)) G(f)^T,   G = H^-1 J^(f)
///
/// S is the periodogram of the residual, averaged over seven neighbouring lines, 1 for white noise of the assumed level; or the spectrum of an
/// autoregression fitted to the residual, where that is more. The first sees lines as narrow as a resonance, but just there the fit has taken part
/// of the noise into its parameters: of the noise's power in line f it leaves 1 - h(f), with the leverage h(f) = conj(J^(f))^T H^-1 J^(f) / n, J with the
/// offset beside theta and over the n samples of the residual, and seven lines' power is divided by what the fit leaves of them (as HC2 of MacKinnon and White, J. Econometrics 29
/// (1985) 305, does by samples).
///
/// A variance that a few lines tell is itself uncertain. It counts as one of chi-square's with nu = 2 E^2 / V degrees of freedom (Satterthwaite,
/// Biometrics Bull. 2 (1946) 110; E its value, V its variance when each line's power scatters by itself), and errors in units of its root have the
/// variance nu / (nu - 2) of Student's t, by which it is multiplied. Coverage: tests/studies/COVERAGE.md.
///
/// An offset c of a channel, which the fit eliminates, is an estimate like the others: its G is dc/dtheta G_theta + c^(f), with c^ the transform of what each sample does to it at fixed
/// theta. The same noise reaches it on both ways.

/// What the noise of runs does to the estimates.
struct ColouredCovariance {
  Eigen::MatrixXd covariance;  ///< over the rows of `influence`
  Eigen::VectorXd spread;      ///< V / 2 of its diagonal

  void add(const ColouredCovariance& run);
  /// With every variance multiplied by its nu / (nu - 2); nu counts as 4 at least, below which t has hardly a variance.
  Eigen::MatrixXd with_its_own_error() const;
};

/// Of one run, whose residuals S is taken from. `influence`: rows G of the estimates over all parameters of the model, zero for those that are held or of another run; row `offset` is
/// that of the run's own first offset, which sees its noise beside that by way of theta. `inverse`: H^-1 over the parameters.
ColouredCovariance coloured_covariance(const RunResidual::Sensitivity& sensitivity, const std::vector<Eigen::VectorXd>& residuals, const Eigen::MatrixXd& influence, Eigen::Index offset,
                                       const Eigen::MatrixXd& inverse);

/// The residual without the samples in which the shaft moves: a motion with a knot on every sample takes up to all of a channel's noise there, and the spectrum of what is left would
/// be too small. The whole residual where it is larger, because the model misses something, and where the shaft hardly rests, then scaled for `unknowns` that were taken out of it.
Eigen::VectorXd residual_at_rest(const Eigen::VectorXd& residual, const std::vector<MotionBasis::Phase>& phases, Eigen::Index unknowns);

/// Probability that white noise looks at least as coloured: Bartlett's test of the cumulative periodogram (Kolmogorov-Smirnov), for the
/// most coloured of the channels, times the number of channels. Left-out samples are 0.
double whiteness(const std::vector<Eigen::VectorXd>& residuals);

/// The strongest line of a residual, looked for at every half of the resolution of its record.
struct Line {
  double place = 0;     ///< frequency over that of the samples
  double over_mean = 0; ///< its power over the mean of all
  double p_value = 1;   ///< probability that white noise has one as strong: R. A. Fisher, Proc. R. Soc. A 125 (1929) 54, the first term, which bounds it, for twice as many lines
};
/// Left-out samples are 0; none of a record of less than sixteen samples.
Line strongest_line(const Eigen::VectorXd& residual);
/// The strongest line between two frequencies (over that of the samples), against those up to thirty resolutions to either side, among which noise of any colour is all but white.
Line strongest_line(const Eigen::VectorXd& residual, double from, double to);

/// Probability that independent noise of one distribution, whatever its level and tails, comes as unevenly over the record: sums of its size about the mean, held against a Brownian bridge (R. L. Brown, J. Durbin and
/// J. M. Evans, J. Royal Statistical Society B 37 (1975) 149). Of the absolute value, which has a variance where squares have none. Left-out samples are 0.
double evenness(const Eigen::VectorXd& residual);

}  // namespace unrig
