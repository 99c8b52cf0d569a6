#include "fit/apparent_mass/decay_model.h"

#include <Eigen/LU>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>
#include <stdexcept>

#include "fit/solver/least_squares.h"

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXcd;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// exp((-decay + i omega) t) on all samples, a column per pole. The products lose about one round-off per sample.
MatrixXcd exponentials(const std::vector<Pole>& poles, Index samples, double dt) {
  MatrixXcd z(samples, static_cast<Index>(poles.size()));
  for (Index m = 0; m < z.cols(); ++m) {
    const Pole& pole = poles[static_cast<std::size_t>(m)];
    const std::complex<double> step = std::exp(std::complex<double>(-pole.decay, pole.omega) * dt);
    std::complex<double> value = 1;
    for (Index k = 0; k < samples; ++k, value *= step) z(k, m) = value;
  }
  return z;
}

MatrixXd columns_of(const MatrixXcd& z) {
  MatrixXd columns(z.rows(), 1 + 2 * z.cols());
  columns.col(0).setOnes();
  for (Index m = 0; m < z.cols(); ++m) {
    columns.col(1 + 2 * m) = z.col(m).real();
    columns.col(2 + 2 * m) = z.col(m).imag();
  }
  return columns;
}

std::vector<Pole> poles_of(const VectorXd& values) {
  std::vector<Pole> poles;
  for (Index m = 0; 2 * m < values.size(); ++m) poles.push_back({values[2 * m], values[2 * m + 1]});
  return poles;
}

}  // namespace

DecayModel::DecayModel(MatrixXd signal, double dt, VectorXd sigma) : signal_(std::move(signal)), dt_(dt), sigma_(std::move(sigma)) {
  if (!(dt > 0) || sigma_.size() != signal_.cols() || !(sigma_.array() > 0).all())
    throw std::invalid_argument("a decay needs a positive sampling interval and a positive noise level for every channel");
  weight_.setZero(signal_.rows(), signal_.cols());
  for (Index c = 0; c < channels(); ++c) {
    for (Index k = 0; k < samples(); ++k) {
      if (std::isfinite(signal_(k, c)))
        weight_(k, c) = 1 / sigma_[c], ++observations_;
      else
        signal_(k, c) = 0;
    }
  }
}

DecayModel::Evaluation DecayModel::evaluate(const std::vector<Pole>& poles, bool derivatives) const {
  const auto count = static_cast<Index>(poles.size());
  const Index n = samples();
  const MatrixXcd z = exponentials(poles, n, dt_);
  const MatrixXd columns = columns_of(z);
  const VectorXd time = VectorXd::LinSpaced(n, 0, dt_ * static_cast<double>(n - 1));
  Evaluation e;
  e.residual.resize(n * channels());
  e.amplitude.resize(columns.cols(), channels());
  e.significance.resize(count, channels());
  if (derivatives) e.jacobian.resize(n * channels(), 2 * count);
  for (Index c = 0; c < channels(); ++c) {
    const auto weight = weight_.col(c).asDiagonal();
    // Rank-revealing: two poles on top of each other must not produce amplitudes without bounds.
    const Eigen::ColPivHouseholderQR<MatrixXd> qr(weight * columns);
    const Index rank = qr.rank();
    const MatrixXd q = qr.householderQ() * MatrixXd::Identity(n, rank);
    const VectorXd y = weight * signal_.col(c);
    const VectorXd amplitude = qr.solve(y);
    e.amplitude.col(c) = amplitude;
    e.residual.segment(n * c, n) = y - q * (q.transpose() * y);

    // Covariance of the amplitudes at fixed poles, for how far each mode stands above nothing.
    const MatrixXd r = qr.matrixR().topLeftCorner(rank, rank).triangularView<Eigen::Upper>();
    MatrixXd half = MatrixXd::Zero(columns.cols(), rank);
    half.topRows(rank) = r.triangularView<Eigen::Upper>().solve(MatrixXd::Identity(rank, rank));
    half = qr.colsPermutation() * half;
    for (Index m = 0; m < count; ++m) {
      const Eigen::Matrix2d covariance = half.middleRows(1 + 2 * m, 2) * half.middleRows(1 + 2 * m, 2).transpose();
      const Eigen::Vector2d pair = amplitude.segment(1 + 2 * m, 2);
      e.significance(m, c) = covariance.determinant() > 0 ? pair.dot(covariance.inverse() * pair) : 0;
    }
    if (!derivatives) continue;
    MatrixXd slopes(n, 2 * count);  // of the model's prediction at fixed amplitudes
    for (Index m = 0; m < count; ++m) {
      const double a = amplitude[1 + 2 * m], b = amplitude[2 + 2 * m];
      slopes.col(2 * m) = time.cwiseProduct(b * z.col(m).real() - a * z.col(m).imag());
      slopes.col(2 * m + 1) = -time.cwiseProduct(a * z.col(m).real() + b * z.col(m).imag());
    }
    slopes = weight * slopes;
    e.jacobian.middleRows(n * c, n) = q * (q.transpose() * slopes) - slopes;
  }
  e.chi2 = e.residual.squaredNorm();
  return e;
}

double fit_poles(const DecayModel& model, std::vector<Pole>& poles, double precision, int iterations) {
  if (poles.empty()) return model.evaluate(poles, false).chi2;
  const double lowest = 0.2 * 2 * std::numbers::pi / model.duration(), highest = std::numbers::pi / model.dt();
  const double growth = -3 / model.duration(), fastest = 1 / model.dt();
  LeastSquaresProblem problem;
  ResidualTerm term;
  for (const Pole& pole : poles) {
    problem.unknowns.push_back({"omega", pole.omega, lowest, highest});
    problem.unknowns.push_back({"decay", pole.decay, growth, fastest});
  }
  for (std::size_t i = 0; i < problem.unknowns.size(); ++i) term.unknowns.push_back(i);
  term.size = model.samples() * model.channels();
  term.evaluate = [&](const VectorXd& values, VectorXd& residual, MatrixXd* jacobian) {
    DecayModel::Evaluation e = model.evaluate(poles_of(values), jacobian != nullptr);
    residual = std::move(e.residual);
    if (jacobian != nullptr) *jacobian = std::move(e.jacobian);
    return std::isfinite(e.chi2);
  };
  problem.terms.push_back(std::move(term));
  LeastSquaresOptions options;
  options.effort = LeastSquaresOptions::Effort::once;
  options.precision = precision;
  options.iterations = iterations;
  const LeastSquaresResult result = solve_least_squares(problem, options);
  poles = poles_of(result.point.values);
  return result.chi2();
}

}  // namespace unrig
