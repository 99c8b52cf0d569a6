#pragma once
#include <Eigen/Core>
#include <memory>
#include <vector>

#include "core/numerics/spectrum.h"

namespace unrig {

/// Sums over the whole past or future of a record, x zero outside of it:
///
///   past    y_k = sum_(i >= 0) h_i x_(k-i)
///   future  y_k = sum_(i >= 0) h_i x_(k+i)
///
/// By the discrete Fourier transform: of the whole record with as many zeros behind it, or piece by piece (overlap-save) where kernels are given sample by sample over the first `near` samples only
/// and are smooth behind half of them, as responses are in which nothing is left but slow lags:
///
///   h = (1 - u) h + u h,   u = 0 up to near / 2, 1 from near on, a polynomial with three continuous derivatives between.
///
/// The second part varies with i - j as cubic splines through one value every near / 256 samples do, and costs next to nothing: x is weighed onto these nodes, and y interpolated from them. It is
/// off by (near / 256)^4 / 192 of the fourth derivative of u h, for u itself 5e-8 where it bends most. Cost n ln(near), memory besides records and sums that of a piece of 8 near. Rounding is that of the largest y, 1e-15 of it.
/// Records and kernels have these lengths and `near` is a power of two: that is for the caller to see to, but for what throws std::invalid_argument: kernels and whole records of another length.
class Convolution {
 public:
  /// `near` 0: in one piece. Otherwise a power of two from 512 on.
  explicit Convolution(Eigen::Index samples, Eigen::Index near = 0);

  Eigen::Index samples() const { return samples_; }
  /// A kernel is known by its samples 0 .. near() - 1, and those half() + i stride(), i = 0 .. far() - 1: none in one piece, where near() is samples().
  Eigen::Index near() const { return near_; }
  Eigen::Index half() const { return near_ / 2; }
  Eigen::Index stride() const { return stride_; }
  Eigen::Index far() const { return far_; }

  /// Transforms of both parts.
  struct Kernel {
    Eigen::VectorXcd fine, coarse;
  };
  Kernel kernel(const Eigen::VectorXd& near, const Eigen::VectorXd& far) const;

  enum class Direction { past, future };
  struct Sum {
    const Kernel* kernel;
    const double* record;  ///< samples() values
    Direction direction;
    Eigen::Index into;     ///< column of what is returned
  };
  /// The sums that go into each column, samples x columns; only those at some samples, in ascending order, where these are named.
  Eigen::MatrixXd sums(const std::vector<Sum>& sums, Eigen::Index columns, const std::vector<Eigen::Index>& at = {}) const;

  /// Sum of squares of a kernel over time for its power at the lines of `fine`, by Parseval.
  double mean(const Eigen::VectorXd& power) const;
  Eigen::Index length() const { return plan_->length(); }  ///< of the transform behind these lines

 private:
  void add_smooth_parts(const std::vector<Sum>& sums, const std::vector<Eigen::Index>& at, Eigen::MatrixXd& result) const;
  void add_piece(const std::vector<Sum>& sums, Eigen::Index first, const std::vector<Eigen::Index>& at, Eigen::MatrixXd& result) const;
  Eigen::VectorXd onto_nodes(const double* record) const;

  Eigen::Index samples_, near_, stride_ = 0, far_ = 0, margin_ = 0, piece_ = 0, nodes_ = 0;
  std::shared_ptr<const FourierPlan> plan_, coarse_plan_;
};

/// The least `near` with which rows L^i start may be summed piece by piece for any rows and start, L with these eigenvalues: behind near / 2 samples whatever varies within near / 256
/// has died out. 0 where a record of so many samples is better taken in one piece.
Eigen::Index near_samples(const Eigen::VectorXcd& eigenvalues, Eigen::Index samples);

}  // namespace unrig
