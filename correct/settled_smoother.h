#pragma once
#include <Eigen/Core>
#include <vector>

#include "core/convolution.h"
#include "correct/settled_filter.h"

namespace unrig {

/// Smoothing of long records by a settled filter, in time n ln n whatever the number of states: filter and smoother are sums over the past and the future with fixed kernels.
///
///   innovations        e_k = S^(-1/2) (y_k - sum_(i >= 1) C L^(i-1) K y_(k-i))
///   a quantity q x_k   q^ = sum_(i >= 1) q L^(i-1) K y_(k-i) + sum_(i >= 0) (S^(-1/2) C L^i P q')' e_(k+i)
///   its variance       q P q' - sum_(i = 0)^(N-1-k) |S^(-1/2) C L^i P q'|^2
///
/// (P. de Jong, Biometrika 76 (1989) 1085, Eq. 2.1 to 2.4, with the filter settled from the first sample on: the state there is unknown by P, with mean zero.)
class SettledSmoother {
 public:
  SettledSmoother(SettledFilter filter, const Convolution& convolution);

  /// A record, samples x channels, as the smoother wants it. A channel that is zero costs nothing.
  struct Series {
    std::vector<Eigen::VectorXcd> measured, innovation;  ///< transforms per channel; empty: zero
    Eigen::MatrixXd white;                               ///< innovations, samples x channels
  };
  Series series(const Eigen::MatrixXd& y) const;
  Eigen::MatrixXd innovations(const Eigen::MatrixXd& y) const;

  /// A linear combination of the states, as the smoother finds it.
  struct Quantity {
    std::vector<Eigen::VectorXcd> past, future;  ///< transforms of its kernels, per channel
    Eigen::VectorXd variance;                    ///< at every sample
  };
  Quantity quantity(const Eigen::RowVectorXd& q) const;
  Eigen::VectorXd smoothed(const Quantity& q, const Series& series) const;

  /// Far from both ends: sum of squares of what a unit in each channel does to the quantity, times its noise's variance what that noise does.
  Eigen::VectorXd passed_on(const Quantity& q) const;

  const SettledFilter& filter() const { return filter_; }

 private:
  Eigen::MatrixXd free_response(const Eigen::MatrixXd& rows, const Eigen::VectorXd& start) const;

  SettledFilter filter_;
  const Convolution* convolution_;
  std::vector<std::vector<Eigen::VectorXcd>> whiten_;  ///< transforms: innovation a of channel b
};

}  // namespace unrig
