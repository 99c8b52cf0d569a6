#pragma once
#include <Eigen/Core>
#include <memory>
#include <vector>

#include "core/numerics/convolution.h"
#include "correct/long_motion/settled_filter.h"

namespace unrig {

/// Smoothing of long records by a settled filter, at a cost that hardly goes with the number of states: filter and smoother are sums over the past and the future with fixed kernels.
///
///   innovations        e_k = S^(-1/2) (y_k - sum_(i >= 1) C L^(i-1) K y_(k-i))
///   a quantity q x_k   q^ = sum_(i >= 1) q L^(i-1) K y_(k-i) + sum_(i >= 0) (S^(-1/2) C L^i P q')' e_(k+i)
///   its variance       q P q' - sum_(i = 0)^(N-1-k) |S^(-1/2) C L^i P q'|^2
///
/// (P. de Jong, Biometrika 76 (1989) 1085, Eq. 2.1 to 2.4, with the filter settled from the first sample on: the state there is unknown by P, with mean zero.)
class SettledSmoother {
 public:
  /// `convolution`: in one piece, or in pieces that the eigenvalues of L allow (near_samples).
  SettledSmoother(SettledFilter filter, std::shared_ptr<const Convolution> convolution);

  /// A record, samples x channels, with its innovations.
  struct Series {
    Eigen::MatrixXd measured, white;
  };
  Series series(Eigen::MatrixXd y) const;
  /// A channel that is zero costs nothing.
  Eigen::MatrixXd innovations(const Eigen::MatrixXd& y) const;

  /// A linear combination of the states, as the smoother finds it.
  struct Quantity {
    std::vector<Convolution::Kernel> past, future;  ///< per channel
  };
  Quantity quantity(const Eigen::RowVectorXd& q) const;
  /// Its variance at every sample.
  Eigen::VectorXd variance(const Eigen::RowVectorXd& q) const;
  Eigen::VectorXd smoothed(const Quantity& q, const Series& series) const { return smoothed({&q}, series.measured, series.white); }
  /// Several at once: samples x quantities, or only at some samples (Convolution::sums).
  Eigen::MatrixXd smoothed(const std::vector<const Quantity*>& quantities, const Eigen::MatrixXd& measured, const Eigen::MatrixXd& white, const std::vector<Eigen::Index>& at = {}) const;

  /// Far from both ends: sum of squares of what a unit in each channel does to the quantity, times its noise's variance what that noise does.
  Eigen::VectorXd passed_on(const Quantity& q) const;

  const SettledFilter& filter() const { return filter_; }
  const Convolution& convolution() const { return *convolution_; }

 private:
  /// rows L^(i - delay) start for i >= delay, as a Convolution wants to know it: its samples x rows.
  struct Response {
    Eigen::MatrixXd near, far;
    Convolution::Kernel kernel(const Convolution& convolution, Eigen::Index row) const;
  };
  Response free_response(const Eigen::MatrixXd& rows, const Eigen::VectorXd& start, Eigen::Index delay) const;

  SettledFilter filter_;
  std::shared_ptr<const Convolution> convolution_;
  Eigen::MatrixXd before_half_, stride_;                ///< L^(half - 1), L^stride
  std::vector<std::vector<Convolution::Kernel>> whiten_;  ///< innovation a of channel b
};

}  // namespace unrig
