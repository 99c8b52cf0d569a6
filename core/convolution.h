#pragma once
#include <Eigen/Core>
#include <memory>

#include "core/spectrum.h"

namespace unrig {

/// Sums over the whole past or future of a record, by the discrete Fourier transform with as many zeros behind it as it is long:
///
///   past    y_k = sum_(i >= 0) h_i x_(k-i)      past(transform of h, transform of x)
///   future  y_k = sum_(i >= 0) h_i x_(k+i)      future(likewise)
///
/// Cost n ln n for records and kernels of n samples at most. Rounding is that of the largest y, 1e-15 of it.
/// Throws std::invalid_argument as `fourier` does.
class Convolution {
 public:
  explicit Convolution(Eigen::Index samples);

  Eigen::Index samples() const { return samples_; }
  Eigen::Index length() const { return plan_->length(); }  ///< of the transform
  Eigen::VectorXcd transform(const Eigen::VectorXd& x) const;
  Eigen::VectorXd inverse(const Eigen::VectorXcd& lines) const;  ///< of a product of transforms: the first `samples`
  Eigen::VectorXd past(const Eigen::VectorXcd& kernel, const Eigen::VectorXcd& x) const { return inverse(kernel.cwiseProduct(x)); }
  Eigen::VectorXd future(const Eigen::VectorXcd& kernel, const Eigen::VectorXcd& x) const { return inverse(kernel.conjugate().cwiseProduct(x)); }
  /// Mean over the whole circle of a quantity that is the same for opposite frequencies, given at the lines: by Parseval, the sum of squares of what has this power.
  double mean(const Eigen::VectorXd& power) const;

 private:
  Eigen::Index samples_;
  std::shared_ptr<const FourierPlan> plan_;
};

}  // namespace unrig
