#pragma once
#include <Eigen/Core>
#include <vector>

namespace unrig {

/// A pole of a free decay: exp(-decay t) cos(omega t + phase).
struct Pole {
  double omega = 0;  ///< rad/s, damped
  double decay = 0;  ///< 1/s
};

/// Free decays as a sum of damped sinusoids and a constant, every channel with its own amplitudes and phases:
///
///   y_c(t) = d_c + sum_m exp(-sigma_m t) (a_cm cos omega_m t + b_cm sin omega_m t),  t = 0 at the first sample
///
/// For given poles the amplitudes a, b and the offset d are linear and eliminated exactly (variable projection, G. H. Golub and V. Pereyra, SIAM J.
/// Numer. Anal. 10 (1973) 413). Samples that are NaN do not count.
class DecayModel {
 public:
  /// `signal`: samples x channels, `dt` [s] apart; `sigma`: standard deviation of each channel's noise, in its unit.
  DecayModel(Eigen::MatrixXd signal, double dt, Eigen::VectorXd sigma);

  struct Evaluation {
    double chi2 = 0;
    Eigen::VectorXd residual;   ///< samples x channels, channel after channel: (measured - model) / sigma, 0 where missing
    Eigen::MatrixXd jacobian;   ///< d residual / d (omega_1, sigma_1, omega_2, ...) after Kaufman: exact gradient, Gauss-Newton Hessian; empty
                                ///< where it was not asked for
    Eigen::MatrixXd amplitude;  ///< per channel a column: d, a_1, b_1, a_2, ..., in the channel's unit
    Eigen::MatrixXd significance;  ///< per channel a column: chi-square by which each mode's (a, b) differ from zero at fixed poles
  };
  Evaluation evaluate(const std::vector<Pole>& poles, bool derivatives) const;

  const Eigen::MatrixXd& signal() const { return signal_; }
  Eigen::Index samples() const { return signal_.rows(); }
  Eigen::Index channels() const { return signal_.cols(); }
  Eigen::Index observations() const { return observations_; }
  double dt() const { return dt_; }
  double duration() const { return dt_ * static_cast<double>(samples()); }
  const Eigen::VectorXd& sigma() const { return sigma_; }

 private:
  Eigen::MatrixXd signal_;
  Eigen::MatrixXd weight_;  ///< 1 / sigma, 0 where missing
  double dt_;
  Eigen::VectorXd sigma_;
  Eigen::Index observations_ = 0;
};

/// Least squares over all poles at once, by exact derivatives, from and to `poles`; returns chi-square. `precision`: the search ends where a step of so many standard errors is left.
/// Bounds keep a pole inside what the record can show: 0.2 periods in the record to the Nyquist frequency, growth by at most e^3 over the record,
/// decay by at most a factor e in a sample.
double fit_poles(const DecayModel& model, std::vector<Pole>& poles, double precision = 1e-2, int iterations = 100);

}  // namespace unrig
