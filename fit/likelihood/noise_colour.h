#pragma once
#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "core/propagate/exact_step.h"

namespace unrig {

/// Noise of a channel that is more than white: e_k = w_k + sum_i n_i, with w white and n_i exponentially correlated,
///
///   n_{k+1} = a n_k + v_k,  a = exp(-2 pi f dt),   spectrum  c (1 - a^2) / (1 - 2 a cos omega + a^2)  at omega radians per sample.
///
/// Few of them make 1/f noise over the decades of a record, and one below (one in each decade: M. S. Keshner, Proc. IEEE 70 (1982) 212, where no lowest frequency is seen). Beside them, falling parts: noise that a filter against aliasing has
/// kept from the end of the spectrum, white noise through a Butterworth filter of first order,
///
///   m_{k+1} = b m_k + u_{k+1} + u_k,  b = (1 - tan(pi f dt)) / (1 + tan(pi f dt)),   spectrum  c (1 - b) (1 + cos omega) / (1 - 2 b cos omega + b^2).
///
/// All spectra only fall: neither a line nor a resonance is among them, so that physics that was left out does not pass for noise.
struct NoiseColour {
  Eigen::VectorXd corner;     ///< f of each part [Hz]
  Eigen::VectorXd power;      ///< c, variance of each part [square of the residual's unit]
  double white = 0;           ///< variance of w
  Eigen::VectorXd falling{};  ///< variance of each falling part, whose corners are at 1/4, 3/8 and 9/20 of the sampling rate; or empty

  /// Variance of the whole.
  double variance() const { return white + power.sum() + falling.sum(); }
  /// Of noise that is so many times as large.
  NoiseColour times(double size) const { return {corner, size * size * power, size * size * white, size * size * falling}; }
  /// Its one-sided spectrum, of samples `dt` [s] apart, at a frequency [Hz]; per Hz.
  double density(double frequency, double dt) const;
};

struct ChannelColour {
  std::string channel;
  NoiseColour colour;  ///< in units of the variance that the channel's noise counts with
};

/// What is left of a channel, `dt` [s] apart; not a number where it does not count.
struct RestResidual {
  Eigen::VectorXd value;
  double dt = 0;
};

/// The colour that residuals have in common; none where white noise of one variance in each of them explains them.
///
/// Whittle's likelihood of the periodograms of stretches without left-out samples is greatest. The powers are found by the multiplicative steps of C. Fevotte, N. Bertin and J.-L. Durrieu,
/// Neural Comput. 21 (2009) 793, for the distance of Itakura and Saito. Colour counts where twice the logarithm of its likelihood over white noise's has a probability below 1e-3 in white noise
/// (falling parts: over the likelihood without them), and where what the colour leaves of each stretch is white (Bartlett's test, and Fisher's of the largest line, at the same level, corrected for their number).
std::optional<NoiseColour> colour_of(const std::vector<RestResidual>& residuals);

/// The colour that most residuals have in common, half of them at least: the one farthest from white behind it is left out, one at a time, until colour_of has an answer.
std::optional<NoiseColour> colour_of_most(std::vector<RestResidual> residuals);

/// `colour` in the size that is most likely for this residual; none where it is not a stretch long enough.
std::optional<NoiseColour> sized(const NoiseColour& colour, const RestResidual& residual);

/// The filter that makes such noise white: its innovations, from the steady Kalman filter of the parts (B. D. O. Anderson and J. B. Moore, Optimal Filtering (1979), section 9.2),
///
///   s_{k+1} = F s_k + K e_k,   white_k = g (e_k - h s_k),   F = diag(poles) - K h,  h = [1 .. 1],
///
/// with g so that it leaves a constant alone. The white noise has the standard deviation `sigma`.
class WhiteningFilter {
 public:
  WhiteningFilter(const NoiseColour& colour, double dt);

  Eigen::Index states() const { return gain_.size(); }
  double sigma() const { return sigma_; }
  double gain() const { return g_; }

  /// The state that a constant of 1 leads to.
  Eigen::VectorXd settled() const;
  /// Readings without gaps, filtered from the settled state of the first.
  Eigen::VectorXd filtered(const Eigen::VectorXd& readings) const;
  /// Columns of samples, filtered in place from the states in `state` (states x columns), which is left at those behind the last sample.
  void filter(Eigen::Ref<Eigen::MatrixXd> columns, Eigen::MatrixXd& state) const;
  /// R with R^T R the inverse covariance of the noise's own state s_0 at the first sample.
  Eigen::MatrixXd start_information() const;
  /// log |det R|, whose rows are orthogonal.
  double log_start_information() const { return start_information().rowwise().norm().array().log().sum(); }

  /// Sends output `channel` of a sampled system through the filter: its states stand behind the others. The system's A, B and D then no longer belong to its C.
  void append(Eigen::Index channel, LinearSystem& system, ExactStep& step) const;

 private:
  Eigen::VectorXd pole_, gain_;
  Eigen::MatrixXd feed_;      // F
  Eigen::MatrixXd unknown_;   // covariance of s_0
  double g_ = 1, sigma_ = 0;
};

}  // namespace unrig
