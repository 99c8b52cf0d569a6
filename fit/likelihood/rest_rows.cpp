#include "fit/likelihood/rest_rows.h"

#include "core/numerics/product.h"
#include "fit/likelihood/run_linearised.h"

namespace unrig::rest_rows {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

const MatrixXd& polynomials() {
  static const MatrixXd basis = orthonormal_polynomials(stretch_samples);
  return basis;
}

}  // namespace

MatrixXd orthonormal_polynomials(Index samples) {
  // Chebyshev's are nearly orthogonal already.
  const VectorXd x = VectorXd::LinSpaced(samples, -1, 1);
  MatrixXd chebyshev(samples, smooth_terms);
  chebyshev.col(0).setOnes();
  chebyshev.col(1) = x;
  for (Index k = 2; k < smooth_terms; ++k) chebyshev.col(k) = 2 * x.cwiseProduct(chebyshev.col(k - 1)) - chebyshev.col(k - 2);
  return Eigen::HouseholderQR<MatrixXd>(chebyshev).householderQ() * MatrixXd::Identity(samples, smooth_terms);
}

const VectorXd& smooth_constant() {
  static const VectorXd coefficients = polynomials().transpose() * VectorXd::Ones(stretch_samples);
  return coefficients;
}

SmoothReadings smooth_readings(const Eigen::Ref<const VectorXd>& w, const Eigen::Ref<const VectorXd>& y) {
  const MatrixXd& B = polynomials();
  if ((w.array() == w[0]).all()) {
    const VectorXd coefficients = B.transpose() * y;
    return {w[0] * MatrixXd::Identity(smooth_terms, smooth_terms), w[0] * coefficients, w[0] * w[0] * (y - B * coefficients).squaredNorm()};
  }
  const Householder qr(w.asDiagonal() * B);
  const VectorXd rotated = qr.rotated(w.cwiseProduct(y)).col(0);
  return {qr.triangle(), rotated.head(smooth_terms), rotated.tail(rotated.size() - smooth_terms).squaredNorm()};
}

FreeRows::FreeRows(MatrixXd free_rows) : rows(std::move(free_rows)) {
  if (rows.rows() < stretch_samples) return;
  const auto stretch = rows.topRows(stretch_samples);
  const Index n = rows.cols();
  MatrixXd span(stretch_samples, n + 1);
  span << stretch, VectorXd::Ones(stretch_samples);
  rotation = std::make_shared<const Householder>(std::move(span));
  size = rotation->triangle().topLeftCorner(n, n);
  smooth = polynomials().transpose() * stretch;
  rough = Householder(stretch - polynomials() * smooth).triangle();
}

bool FreeRows::is_smooth(const MatrixXd& state, const MatrixXd& before) const {
  constexpr double rounding = 1e-11;
  if (rough.size() == 0) return false;
  return (product(rough, state).colwise().norm().array() <= rounding * product(size, before).colwise().norm().array()).all();
}

SmoothResponse::SmoothResponse(const FreeResponse& free) : leap_(free.leap()) {
  // A polynomial over a stretch is one over each half of it: coefficients of the halves add up to those of the whole.
  for (Index c = 0; c < free.channels(); ++c) rows_.push_back(orthonormal_polynomials(FreeResponse::block_length).transpose() * free.block(c));
  MatrixXd B = orthonormal_polynomials(FreeResponse::block_length);
  for (Index length = FreeResponse::block_length; length < stretch_samples; length *= 2) {
    const MatrixXd twice = orthonormal_polynomials(2 * length);
    const MatrixXd first = twice.topRows(length).transpose() * B, second = twice.bottomRows(length).transpose() * B;
    for (DualMatrix& rows : rows_) rows = first * rows + second * (rows * leap_);
    leap_ = leap_ * leap_;
    B = twice;
  }
}

Response SmoothResponse::from(const DualMatrix& start) const {
  const auto channels = static_cast<Index>(rows_.size());
  Response response;
  response.output.resize(smooth_terms, channels);
  response.partial.resize(start.partial.size());
  for (Index c = 0; c < channels; ++c) {
    const DualMatrix coefficients = rows_[static_cast<std::size_t>(c)] * start;
    response.output.col(c) = coefficients.value;
    for (std::size_t j = 0; j < response.partial.size(); ++j) {
      if (!coefficients.depends_on(static_cast<Index>(j))) continue;
      if (response.partial[j].size() == 0) response.partial[j] = MatrixXd::Zero(smooth_terms, channels);
      response.partial[j].col(c) = coefficients.d(static_cast<Index>(j));
    }
  }
  response.end = leap_ * start;
  return response;
}

}  // namespace unrig::rest_rows
