#include "correct/prior.h"

#include <Eigen/Cholesky>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <filesystem>

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

bool took_part(const FittedRig& fit, const std::string& run_file) {
  const auto name = [](const std::string& path) { return std::filesystem::path(path).filename(); };
  return std::any_of(fit.runs.begin(), fit.runs.end(), [&](const std::string& run) { return name(run) == name(run_file); });
}

/// Covariance of rig parameters, as far as the fit has one.
MatrixXd rig_covariance(const AeroelasticModel& model, const FittedRig& fit, const VectorXd& theta, const std::vector<Index>& rig, const std::string& run_file) {
  const auto count = static_cast<Index>(rig.size());
  std::vector<Index> place(rig.size(), -1);
  VectorXd deviation(count);
  for (Index a = 0; a < count; ++a) {
    const FittedParameter* fitted = fit.find(model.parameters()[static_cast<std::size_t>(rig[static_cast<std::size_t>(a)])].name, run_file);
    const bool known = fitted && fitted->std_error > 0 && std::isfinite(fitted->std_error);
    const double whole = std::abs(theta[rig[static_cast<std::size_t>(a)]]);
    deviation[a] = known ? fitted->std_error : std::max(whole, 1e-6);
    if (known) place[static_cast<std::size_t>(a)] = fitted - fit.parameters.data();
  }
  MatrixXd covariance = deviation.cwiseAbs2().asDiagonal();
  for (Index a = 0; a < count; ++a)
    for (Index b = 0; b < count; ++b) {
      const Index i = place[static_cast<std::size_t>(a)], k = place[static_cast<std::size_t>(b)];
      if (a != b && i >= 0 && k >= 0) covariance(a, b) = fit.correlation(i, k) * deviation[a] * deviation[b];
    }
  return covariance;
}

/// L with L L^T = covariance, by way of the correlation matrix.
MatrixXd root_of(const MatrixXd& covariance) {
  const VectorXd deviation = covariance.diagonal().cwiseSqrt();
  const MatrixXd correlation = deviation.cwiseInverse().asDiagonal() * covariance * deviation.cwiseInverse().asDiagonal();
  return deviation.asDiagonal() * MatrixXd(correlation.llt().matrixL());
}

double cost(const RunResidual& residual, const Prior& prior, const VectorXd& theta) {
  return residual.evaluate(theta, Partials::none).chi2 + (prior.rows() * (theta - prior.mean)).squaredNorm();
}

}  // namespace

MatrixXd Prior::regularisation() const {
  MatrixXd rows = MatrixXd::Zero(static_cast<Index>(amplitudes.size()), mean.size());
  for (std::size_t k = 0; k < amplitudes.size(); ++k) rows(static_cast<Index>(k), amplitudes[k]) = 1 / amplitude;
  return rows;
}

MatrixXd Prior::rows() const {
  MatrixXd all(rig.rows() + static_cast<Index>(amplitudes.size()), mean.size());
  all << rig, regularisation();
  return all;
}

Prior prior_of(const AeroelasticModel& model, const FittedRig& fit, const VectorXd& theta, const std::string& run_file) {
  Prior prior;
  prior.mean = theta;
  std::vector<Index> rig;
  for (Index j = 0; j < theta.size(); ++j) (model.parameters()[static_cast<std::size_t>(j)].per_run ? prior.free : rig).push_back(j);
  for (Index k = 0; k < model.circulation().rate.size(); ++k) {
    prior.amplitudes.push_back(model.circulation_parameter(k));
    prior.mean[prior.amplitudes.back()] = 0;
  }
  const MatrixXd root = root_of(rig_covariance(model, fit, theta, rig, run_file));
  if (took_part(fit, run_file)) {
    prior.held = rig;
    prior.held_root = root;
    prior.rig.resize(0, theta.size());
  } else {
    prior.free.insert(prior.free.end(), rig.begin(), rig.end());
    prior.rig = MatrixXd::Zero(root.rows(), theta.size());
    const MatrixXd inverse = root.triangularView<Eigen::Lower>().solve(MatrixXd::Identity(root.rows(), root.cols()));
    prior.rig(Eigen::all, rig) = inverse;
  }
  return prior;
}

VectorXd minimise(const RunResidual& residual, const Prior& prior, VectorXd theta) {
  constexpr int most_steps = 12, most_halvings = 8;
  constexpr double enough = 1e-3;  // of a chi-square whose own scatter is some tens
  const MatrixXd known = prior.rows();
  double now = cost(residual, prior, theta);
  for (int iteration = 0; iteration < most_steps; ++iteration) {
    const RunResidual::Evaluation e = residual.evaluate(theta, Partials::all);
    MatrixXd rows(e.jacobian.rows() + known.rows(), theta.size());
    rows << e.jacobian, known;
    VectorXd right(rows.rows());
    right << -e.residual, -(known * (theta - prior.mean));
    MatrixXd scaled = rows(Eigen::all, prior.free);
    const VectorXd scale = scaled.colwise().norm().transpose().cwiseMax(1e-300).cwiseInverse();
    scaled = scaled * scale.asDiagonal();
    const VectorXd move = scale.cwiseProduct(scaled.colPivHouseholderQr().solve(right));
    double fraction = 1, then = now;
    VectorXd next = theta;
    for (int halving = 0; halving < most_halvings; ++halving, fraction /= 2) {
      next = theta;
      next(prior.free) += fraction * move;
      then = cost(residual, prior, next);
      if (then < now) break;
    }
    if (!(then < now)) break;
    const double gain = now - then;
    theta = next;
    now = then;
    if (gain < enough) break;
  }
  return theta;
}

Evidence evidence(const RunResidual::Evaluation& e, const Prior& prior, const VectorXd& theta) {
  constexpr double least = 0.01, most = 10, settled = 1e-3;
  const auto count = static_cast<Index>(prior.free.size());
  std::vector<Index> place;  // of the amplitudes among the free parameters
  for (const Index j : prior.amplitudes) place.push_back(std::find(prior.free.begin(), prior.free.end(), j) - prior.free.begin());
  MatrixXd rows(e.jacobian.rows() + prior.rig.rows(), theta.size());
  rows << e.jacobian, prior.rig;
  const MatrixXd known = rows(Eigen::all, prior.free);
  const VectorXd at = theta(prior.free);
  VectorXd right(rows.rows());
  right << -e.residual + e.jacobian(Eigen::all, prior.free) * at, -(prior.rig * (theta - prior.mean)) + prior.rig(Eigen::all, prior.free) * at;
  const VectorXd scale = known.colwise().norm().transpose().cwiseMax(1e-12).cwiseInverse();

  Evidence result{prior.amplitude, 0};
  for (int round = 0; round < 100; ++round) {
    MatrixXd stack = MatrixXd::Zero(known.rows() + static_cast<Index>(place.size()), count);
    stack.topRows(known.rows()) = known;
    for (std::size_t k = 0; k < place.size(); ++k) stack(known.rows() + static_cast<Index>(k), place[k]) = 1 / result.amplitude;
    VectorXd target = VectorXd::Zero(stack.rows());
    target.head(known.rows()) = right;
    const Eigen::ColPivHouseholderQR<MatrixXd> qr(stack * scale.asDiagonal());
    const VectorXd best = scale.cwiseProduct(qr.solve(target));
    const MatrixXd inverse = qr.matrixR().topRows(count).triangularView<Eigen::Upper>().solve(MatrixXd::Identity(count, count));
    const MatrixXd root = scale.asDiagonal() * (qr.colsPermutation() * inverse);
    double left_open = 0, size = 0;
    for (const Index p : place) left_open += root.row(p).squaredNorm(), size += best[p] * best[p];
    result.determined = static_cast<double>(place.size()) - left_open / (result.amplitude * result.amplitude);
    const double next = std::clamp(std::sqrt(size / std::max(result.determined, 1e-3)), least, most), change = std::abs(std::log(next / result.amplitude));
    result.amplitude = next;
    if (change < settled) break;
  }
  return result;
}

}  // namespace unrig
