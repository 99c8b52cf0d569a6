#include "correct/settled_smoother.h"

#include <utility>

#include "core/response.h"

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::RowVectorXd;
using Eigen::VectorXcd;
using Eigen::VectorXd;

void add_product(VectorXcd& sum, const VectorXcd& a, const VectorXcd& b) {
  if (a.size() == 0 || b.size() == 0) return;
  if (sum.size() == 0)
    sum = a.cwiseProduct(b);
  else
    sum += a.cwiseProduct(b);
}

}  // namespace

SettledSmoother::SettledSmoother(SettledFilter filter, const Convolution& convolution) : filter_(std::move(filter)), convolution_(&convolution) {
  const Index channels = filter_.C.rows(), samples = convolution.samples();
  whiten_.assign(static_cast<std::size_t>(channels), {});
  for (Index b = 0; b < channels; ++b) {
    MatrixXd kernel(samples, channels);
    kernel.row(0) = filter_.whiten.col(b).transpose();
    kernel.bottomRows(samples - 1) = -free_response(filter_.whiten * filter_.C, filter_.K.col(b)).topRows(samples - 1);
    for (Index a = 0; a < channels; ++a) whiten_[static_cast<std::size_t>(a)].push_back(convolution.transform(kernel.col(a)));
  }
}

/// rows L^k start: samples x rows.
MatrixXd SettledSmoother::free_response(const MatrixXd& rows, const VectorXd& start) const {
  LinearSystem system;
  system.C = DualMatrix(rows);
  ExactStep step;
  step.transition = DualMatrix(filter_.L);
  return FreeResponse(system, step, Partials::none).from(DualMatrix(MatrixXd(start)), convolution_->samples()).output;
}

MatrixXd SettledSmoother::innovations(const MatrixXd& y) const {
  const Index channels = y.cols();
  MatrixXd white = MatrixXd::Zero(y.rows(), channels);
  std::vector<VectorXcd> sum(static_cast<std::size_t>(channels));
  for (Index b = 0; b < channels; ++b) {
    if (y.col(b).isZero(0)) continue;
    const VectorXcd measured = convolution_->transform(y.col(b));
    for (std::size_t a = 0; a < sum.size(); ++a) add_product(sum[a], whiten_[a][static_cast<std::size_t>(b)], measured);
  }
  for (std::size_t a = 0; a < sum.size(); ++a)
    if (sum[a].size() > 0) white.col(static_cast<Index>(a)) = convolution_->inverse(sum[a]);
  return white;
}

SettledSmoother::Series SettledSmoother::series(const MatrixXd& y) const {
  const Index channels = y.cols();
  Series s;
  s.measured.resize(static_cast<std::size_t>(channels));
  s.innovation.resize(s.measured.size());
  for (Index b = 0; b < channels; ++b)
    if (!y.col(b).isZero(0)) s.measured[static_cast<std::size_t>(b)] = convolution_->transform(y.col(b));
  s.white = MatrixXd::Zero(y.rows(), channels);
  for (std::size_t a = 0; a < s.measured.size(); ++a) {
    VectorXcd sum;
    for (std::size_t b = 0; b < s.measured.size(); ++b) add_product(sum, whiten_[a][b], s.measured[b]);
    if (sum.size() == 0) continue;
    s.white.col(static_cast<Index>(a)) = convolution_->inverse(sum);
    s.innovation[a] = convolution_->transform(s.white.col(static_cast<Index>(a)));  // anew: behind the last sample there is none
  }
  return s;
}

SettledSmoother::Quantity SettledSmoother::quantity(const RowVectorXd& q) const {
  const Index samples = convolution_->samples(), channels = filter_.C.rows();
  Quantity result;
  for (Index b = 0; b < channels; ++b) {
    VectorXd kernel = VectorXd::Zero(samples);
    kernel.tail(samples - 1) = free_response(q, filter_.K.col(b)).col(0).head(samples - 1);
    result.past.push_back(convolution_->transform(kernel));
  }
  const VectorXd P_q = filter_.P * q.transpose();
  const MatrixXd future = free_response(filter_.whiten * filter_.C, P_q);
  for (Index a = 0; a < channels; ++a) result.future.push_back(convolution_->transform(future.col(a)));
  result.variance.resize(samples);
  double left = q.dot(P_q);
  for (Index k = samples - 1; k >= 0; --k) {
    left -= future.row(samples - 1 - k).squaredNorm();
    result.variance[k] = left;
  }
  return result;
}

VectorXd SettledSmoother::smoothed(const Quantity& q, const Series& series) const {
  VectorXcd sum;
  for (std::size_t a = 0; a < q.past.size(); ++a) {
    add_product(sum, q.past[a], series.measured[a]);
    if (series.innovation[a].size() > 0) add_product(sum, q.future[a].conjugate(), series.innovation[a]);
  }
  return sum.size() > 0 ? convolution_->inverse(sum) : VectorXd::Zero(convolution_->samples());
}

VectorXd SettledSmoother::passed_on(const Quantity& q) const {
  VectorXd squares(static_cast<Index>(q.past.size()));
  for (std::size_t b = 0; b < q.past.size(); ++b) {
    VectorXcd kernel = q.past[b];
    for (std::size_t a = 0; a < q.past.size(); ++a) kernel += q.future[a].conjugate().cwiseProduct(whiten_[a][b]);
    squares[static_cast<Index>(b)] = convolution_->mean(kernel.cwiseAbs2());
  }
  return squares;
}

}  // namespace unrig
