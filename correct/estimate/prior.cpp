#include "correct/estimate/prior.h"

#include <Eigen/Cholesky>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <utility>

#include "correct/estimate/constrained_step.h"

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

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

double cost(double chi2, const Prior& prior, const VectorXd& theta) { return chi2 + prior.off(theta).squaredNorm(); }

/// Data and prior, linearised: residuals | J d theta, over all parameters.
std::pair<VectorXd, MatrixXd> linear_model(const RunResidual::Evaluation& e, const Prior& prior, const VectorXd& theta) {
  const MatrixXd known = prior.rows();
  MatrixXd rows(e.jacobian.rows() + known.rows(), theta.size());
  rows << e.jacobian, known;
  VectorXd residual(rows.rows());
  residual << e.residual, prior.off(theta);
  return {residual, rows};
}

}  // namespace

MatrixXd Prior::regularisation() const {
  MatrixXd rows = MatrixXd::Zero(static_cast<Index>(amplitudes.size()), known.cols());
  for (std::size_t k = 0; k < amplitudes.size(); ++k) rows(static_cast<Index>(k), amplitudes[k]) = 1 / (amplitude * share[static_cast<Index>(k)]);
  return rows;
}

MatrixXd Prior::rows() const {
  MatrixXd all(known.rows() + static_cast<Index>(amplitudes.size()), known.cols());
  all << known, regularisation();
  return all;
}

VectorXd Prior::off(const VectorXd& theta) const {
  VectorXd all(known.rows() + static_cast<Index>(amplitudes.size()));
  all << known * theta - known_value, regularisation() * theta;
  return all;
}

bool Prior::allows(const VectorXd& theta) const {
  constexpr double rounding = 1e-9;  // of the response
  return rising.rows() == 0 || (rising * theta).minCoeff() > -rounding;
}

Prior impose(Prior prior, const Imposed& imposed, const AeroelasticModel& model, const VectorXd& semichords) {
  constexpr double exactly = 1e-6;
  const Index parameters = prior.known.cols(), rows = prior.known.rows();
  if (imposed.at_step) {
    prior.known.conservativeResize(rows + 1, parameters);
    prior.known.row(rows).setZero();
    for (const Index j : prior.amplitudes) prior.known(rows, j) = 1 / exactly;
    prior.known_value.conservativeResize(rows + 1);
    prior.known_value[rows] = (1 - *imposed.at_step) / exactly;
  }
  if (!imposed.monotone) return prior;
  // phi(s_i) - phi(s_(i-1)) = sum_k A_k (exp(-beta_k s_(i-1)) - exp(-beta_k s_i)); s_-1 = 0. Behind the last, ten times as far.
  VectorXd s(semichords.size() + 12);
  s << 0, semichords, (VectorXd::LinSpaced(11, 0, 1) * std::log(10.0)).array().exp() * semichords[semichords.size() - 1] * 1.01;
  prior.rising = MatrixXd::Zero(s.size() - 1, parameters);
  for (std::size_t k = 0; k < prior.amplitudes.size(); ++k) {
    const VectorXd decay = (-model.circulation().rate[static_cast<Index>(k)] * s.array()).exp();
    prior.rising.col(prior.amplitudes[k]) = decay.head(s.size() - 1) - decay.tail(s.size() - 1);
  }
  return prior;
}

Prior prior_of(const AeroelasticModel& model, const FittedRig& fit, const VectorXd& theta, const std::string& run_file) {
  Prior prior;
  std::vector<Index> rig;
  for (Index j = 0; j < theta.size(); ++j) (model.parameters()[static_cast<std::size_t>(j)].per_run ? prior.free : rig).push_back(j);
  for (Index k = 0; k < model.circulation().rate.size(); ++k) prior.amplitudes.push_back(model.circulation_parameter(k));
  constexpr double slow = 0.05;  // per semichord
  prior.share = (model.circulation().rate.array() / slow).min(1.0);
  const MatrixXd root = root_of(rig_covariance(model, fit, theta, rig, run_file));
  if (!fit.recorded_as(run_file).empty()) {
    prior.held = rig;
    prior.held_root = root;
    prior.known.resize(0, theta.size());
  } else {
    prior.free.insert(prior.free.end(), rig.begin(), rig.end());
    prior.known = MatrixXd::Zero(root.rows(), theta.size());
    const MatrixXd inverse = root.triangularView<Eigen::Lower>().solve(MatrixXd::Identity(root.rows(), root.cols()));
    prior.known(Eigen::all, rig) = inverse;
  }
  prior.known_value = prior.known * theta;
  return prior;
}

VectorXd gauss_newton_step(const RunResidual::Evaluation& e, const Prior& prior, const VectorXd& theta) {
  const auto [residual, rows] = linear_model(e, prior, theta);
  if (prior.rising.rows() > 0) {
    VectorXd step = VectorXd::Zero(theta.size());
    step(prior.free) = least_squares_above(rows(Eigen::all, prior.free), -residual, prior.rising(Eigen::all, prior.free), -prior.rising * theta);
    return step;
  }
  MatrixXd scaled = rows(Eigen::all, prior.free);
  const VectorXd scale = scaled.colwise().norm().transpose().cwiseMax(1e-300).cwiseInverse();
  scaled = scaled * scale.asDiagonal();
  VectorXd step = VectorXd::Zero(theta.size());
  step(prior.free) = scale.cwiseProduct(scaled.colPivHouseholderQr().solve(-residual));
  return step;
}

Search minimise(const RunResidual& residual, Prior prior, const VectorXd& theta, double enough, bool learn) {
  return minimise({[&](const VectorXd& at) { return residual.solve(at); }, [&](const RunResidual::Solution& solution) { return residual.differentiate(solution); }}, std::move(prior), theta,
                  enough, learn);
}

Search minimise(const Searched& run, Prior prior, const VectorXd& theta, double enough, bool learn) {
  constexpr int most_steps = 12, most_halvings = 8;
  constexpr double settled = 0.02;  // of the logarithm of tau
  Search search{std::move(prior), run.solve(theta), {}, 0};
  for (int step = 0; step < most_steps; ++step) {
    const VectorXd& at = search.solution.theta;
    search.evaluation = run.differentiate(search.solution);
    double change = 0;
    if (learn) {
      const Evidence best = evidence(search.evaluation, search.prior, at);
      change = std::abs(std::log(best.amplitude / search.prior.amplitude));
      search.prior.amplitude = best.amplitude;
      search.determined = best.determined;
    }
    const double now = cost(search.solution.chi2, search.prior, at);
    const VectorXd move = gauss_newton_step(search.evaluation, search.prior, at);
    const auto [left, rows] = linear_model(search.evaluation, search.prior, at);
    const double promised = left.squaredNorm() - (left + rows * move).squaredNorm();
    const bool allowed = search.prior.allows(at);
    if ((allowed && promised < enough && change < settled) || step == most_steps - 1) break;
    bool moved = false;
    double fraction = 1;
    for (int halving = 0; halving < most_halvings && !moved; ++halving, fraction /= 2) {
      RunResidual::Solution next = run.solve(run.advance ? run.advance(at, fraction * move) : at + fraction * move);
      moved = std::isfinite(next.chi2) && (!allowed || cost(next.chi2, search.prior, next.theta) < now);
      if (moved) search.solution = std::move(next);
    }
    if (!moved) break;
  }
  return search;
}

double minus_twice_log_evidence(const RunResidual& residual, const Search& search) {
  const Prior& prior = search.prior;
  const VectorXd& theta = search.solution.theta;
  const auto twice_log = [](const MatrixXd& triangle) {
    double sum = 0;
    for (const double d : triangle.diagonal())
      if (d != 0) sum += 2 * std::log(std::abs(d));
    return sum;
  };
  const MatrixXd rows = linear_model(search.evaluation, prior, theta).second, regularisation = prior.regularisation();
  const MatrixXd of_theta = Eigen::HouseholderQR<MatrixXd>(rows(Eigen::all, prior.free)).matrixQR().topRows(static_cast<Index>(prior.free.size()));
  return cost(search.solution.chi2, prior, theta) + twice_log(search.evaluation.linear_factor) + twice_log(of_theta) - twice_log(regularisation(Eigen::all, prior.amplitudes)) - 2 * residual.log_noise_density();
}

Evidence evidence(const RunResidual::Evaluation& e, const Prior& prior, const VectorXd& theta) {
  constexpr double least = 0.01, most = 10, settled = 1e-3;
  const auto count = static_cast<Index>(prior.free.size());
  std::vector<Index> place;  // of the amplitudes among the free parameters
  for (const Index j : prior.amplitudes) place.push_back(std::find(prior.free.begin(), prior.free.end(), j) - prior.free.begin());
  MatrixXd rows(e.jacobian.rows() + prior.known.rows(), theta.size());
  rows << e.jacobian, prior.known;
  const MatrixXd known = rows(Eigen::all, prior.free);
  const VectorXd at = theta(prior.free);
  VectorXd right(rows.rows());
  right << -e.residual + e.jacobian(Eigen::all, prior.free) * at, prior.known_value - prior.known * theta + prior.known(Eigen::all, prior.free) * at;
  const VectorXd scale = known.colwise().norm().transpose().cwiseMax(1e-12).cwiseInverse();

  Evidence result{prior.amplitude, 0};
  for (int round = 0; round < 100; ++round) {
    MatrixXd stack = MatrixXd::Zero(known.rows() + static_cast<Index>(place.size()), count);
    stack.topRows(known.rows()) = known;
    for (std::size_t k = 0; k < place.size(); ++k) stack(known.rows() + static_cast<Index>(k), place[k]) = 1 / (result.amplitude * prior.share[static_cast<Index>(k)]);
    VectorXd target = VectorXd::Zero(stack.rows());
    target.head(known.rows()) = right;
    const Eigen::ColPivHouseholderQR<MatrixXd> qr(stack * scale.asDiagonal());
    const VectorXd best = scale.cwiseProduct(qr.solve(target));
    const MatrixXd inverse = qr.matrixR().topRows(count).triangularView<Eigen::Upper>().solve(MatrixXd::Identity(count, count));
    const MatrixXd root = scale.asDiagonal() * (qr.colsPermutation() * inverse);
    double left_open = 0, size = 0;
    for (std::size_t k = 0; k < place.size(); ++k) {
      const double share = prior.share[static_cast<Index>(k)];
      left_open += root.row(place[k]).squaredNorm() / (share * share);
      size += std::pow(best[place[k]] / share, 2);
    }
    result.determined = static_cast<double>(place.size()) - left_open / (result.amplitude * result.amplitude);
    const double next = std::clamp(std::sqrt(size / std::max(result.determined, 1e-3)), least, most), change = std::abs(std::log(next / result.amplitude));
    result.amplitude = next;
    if (change < settled) break;
  }
  return result;
}

}  // namespace unrig
