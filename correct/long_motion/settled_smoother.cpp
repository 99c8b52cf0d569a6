#include "correct/long_motion/settled_smoother.h"

#include <utility>

#include "core/propagate/response.h"

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::RowVectorXd;
using Eigen::VectorXcd;
using Eigen::VectorXd;
using Direction = Convolution::Direction;

/// rows L^i start: samples x rows.
MatrixXd sampled(const MatrixXd& rows, const MatrixXd& L, const VectorXd& start, Index samples) {
  LinearSystem system;
  system.C = DualMatrix(rows);
  ExactStep step;
  step.transition = DualMatrix(L);
  return FreeResponse(system, step, Partials::none).from(DualMatrix(MatrixXd(start)), samples).output;
}

}  // namespace

SettledSmoother::SettledSmoother(SettledFilter filter, std::shared_ptr<const Convolution> convolution) : filter_(std::move(filter)), convolution_(std::move(convolution)) {
  if (convolution_->stride() > 0) {
    before_half_ = power(filter_.L, convolution_->half() - 1);
    stride_ = power(filter_.L, convolution_->stride());
  }
  const Index channels = filter_.C.rows();
  whiten_.assign(static_cast<std::size_t>(channels), {});
  for (Index b = 0; b < channels; ++b) {
    Response response = free_response(-filter_.whiten * filter_.C, filter_.K.col(b), 1);
    response.near.row(0) = filter_.whiten.col(b).transpose();
    for (Index a = 0; a < channels; ++a) whiten_[static_cast<std::size_t>(a)].push_back(response.kernel(*convolution_, a));
  }
}

Convolution::Kernel SettledSmoother::Response::kernel(const Convolution& convolution, Index row) const { return convolution.kernel(near.col(row), far.col(row)); }

SettledSmoother::Response SettledSmoother::free_response(const MatrixXd& rows, const VectorXd& start, Index delay) const {
  Response response;
  const Index near = convolution_->near();
  response.near = MatrixXd::Zero(near, rows.rows());
  response.near.bottomRows(near - delay) = sampled(rows, filter_.L, start, near - delay);
  response.far.resize(convolution_->far(), rows.rows());
  if (convolution_->far() > 0) {
    const VectorXd one_before_half = before_half_ * start;
    response.far = sampled(rows, stride_, delay == 1 ? one_before_half : filter_.L * one_before_half, convolution_->far());
  }
  return response;
}

MatrixXd SettledSmoother::innovations(const MatrixXd& y) const {
  std::vector<Convolution::Sum> sums;
  for (Index b = 0; b < y.cols(); ++b) {
    if (y.col(b).isZero(0)) continue;
    for (Index a = 0; a < y.cols(); ++a) sums.push_back({&whiten_[static_cast<std::size_t>(a)][static_cast<std::size_t>(b)], y.col(b).data(), Direction::past, a});
  }
  return convolution_->sums(sums, y.cols());
}

SettledSmoother::Series SettledSmoother::series(MatrixXd y) const {
  Series s;
  s.white = innovations(y);
  s.measured = std::move(y);
  return s;
}

SettledSmoother::Quantity SettledSmoother::quantity(const RowVectorXd& q) const {
  Quantity result;
  const Index channels = filter_.C.rows();
  for (Index b = 0; b < channels; ++b) result.past.push_back(free_response(q, filter_.K.col(b), 1).kernel(*convolution_, 0));
  const Response future = free_response(filter_.whiten * filter_.C, filter_.P * q.transpose(), 0);
  for (Index a = 0; a < channels; ++a) result.future.push_back(future.kernel(*convolution_, a));
  return result;
}

VectorXd SettledSmoother::variance(const RowVectorXd& q) const {
  const Index samples = convolution_->samples(), near = convolution_->near();
  const VectorXd P_q = filter_.P * q.transpose();
  const Response future = free_response(filter_.whiten * filter_.C, P_q, 0);
  VectorXd variance(samples);
  double left = q.dot(P_q);
  for (Index i = 0; i < samples; ++i) {
    left -= (i < near ? future.near.row(i) : future.far.row((i - convolution_->half()) / convolution_->stride())).squaredNorm();
    variance[samples - 1 - i] = left;
  }
  return variance;
}

MatrixXd SettledSmoother::smoothed(const std::vector<const Quantity*>& quantities, const MatrixXd& measured, const MatrixXd& white, const std::vector<Index>& at) const {
  std::vector<Convolution::Sum> sums;
  for (std::size_t i = 0; i < quantities.size(); ++i)
    for (Index a = 0; a < white.cols(); ++a) {
      const auto channel = static_cast<std::size_t>(a);
      const auto into = static_cast<Index>(i);
      if (!measured.col(a).isZero(0)) sums.push_back({&quantities[i]->past[channel], measured.col(a).data(), Direction::past, into});
      if (!white.col(a).isZero(0)) sums.push_back({&quantities[i]->future[channel], white.col(a).data(), Direction::future, into});
    }
  return convolution_->sums(sums, static_cast<Index>(quantities.size()), at);
}

VectorXd SettledSmoother::passed_on(const Quantity& q) const {
  VectorXd squares(static_cast<Index>(q.past.size()));
  for (std::size_t b = 0; b < q.past.size(); ++b) {
    VectorXcd kernel = q.past[b].fine;
    for (std::size_t a = 0; a < q.past.size(); ++a) kernel += q.future[a].fine.conjugate().cwiseProduct(whiten_[a][b].fine);
    squares[static_cast<Index>(b)] = convolution_->mean(kernel.cwiseAbs2());
  }
  return squares;
}

}  // namespace unrig
