#include "correct/correct.h"

#include <Eigen/Cholesky>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <limits>

#include <fmt/format.h>

#include "core/rigid_load.h"
#include "fit/motion_prior.h"
#include "fit/run_residual.h"

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double prior_amplitude = 0.5;

/// Rates evenly spread over ln s, from the record's length to a sixth of a semichord, a factor of about 2.5 apart: Wagner's function, and any
/// other that varies on a logarithmic scale, is within 1e-3 of such a sum.
VectorXd rates_for(double semichords) {
  constexpr double fastest = 6, factor = 2.5;
  const double slowest = 1 / semichords;
  const auto count = static_cast<Index>(std::round(std::log(fastest / slowest) / std::log(factor))) + 1;
  VectorXd rates(std::clamp<Index>(count, 3, 12));
  for (Index k = 0; k < rates.size(); ++k) rates[k] = slowest * std::pow(fastest / slowest, static_cast<double>(k) / static_cast<double>(rates.size() - 1));
  return rates;
}

/// Amplitudes with which the rates come nearest to Wagner's function: where the search starts, not what it is held to.
VectorXd wagner_amplitudes(const VectorXd& rates, double semichords) {
  constexpr Index points = 60;
  MatrixXd basis(points, rates.size());
  VectorXd missing(points);
  for (Index i = 0; i < points; ++i) {
    const double s = 0.02 * std::pow(semichords / 0.02, static_cast<double>(i) / (points - 1));
    basis.row(i) = (-rates * s).array().exp().matrix().transpose();
    missing[i] = 1 - wagner_exact(s);
  }
  const MatrixXd ridge = basis.transpose() * basis + 1e-6 * MatrixXd::Identity(rates.size(), rates.size());
  return ridge.ldlt().solve(basis.transpose() * missing);
}

/// Prior knowledge as rows to stack under the data: sqrt(precision) (theta - mean).
struct Prior {
  VectorXd mean;
  MatrixXd root;
};

/// The rig's parameters as the fit left them, correlations included; amplitudes around zero; no knowledge of the slope.
Prior prior_of(const AeroelasticModel& model, const FittedRig& fit, const VectorXd& theta, const std::string& run_file) {
  const Index n = theta.size();
  Prior prior{theta, MatrixXd::Zero(n, n)};
  std::vector<Index> known;          // index into theta
  std::vector<std::size_t> fitted;   // index into the fit
  for (Index j = 0; j < n; ++j) {
    const Parameter& p = model.parameters()[static_cast<std::size_t>(j)];
    if (p.per_run) continue;
    for (std::size_t i = 0; i < fit.parameters.size(); ++i)
      if (&fit.parameters[i] == fit.find(p.name, run_file) && fit.parameters[i].std_error > 0) {
        known.push_back(j);
        fitted.push_back(i);
      }
  }
  const auto count = static_cast<Index>(known.size());
  MatrixXd covariance(count, count);
  for (Index a = 0; a < count; ++a)
    for (Index b = 0; b < count; ++b) {
      const auto i = fitted[static_cast<std::size_t>(a)], k = fitted[static_cast<std::size_t>(b)];
      covariance(a, b) = fit.correlation(static_cast<Index>(i), static_cast<Index>(k)) * fit.parameters[i].std_error * fit.parameters[k].std_error;
    }
  const VectorXd scale = covariance.diagonal().cwiseSqrt();
  const MatrixXd correlation = scale.cwiseInverse().asDiagonal() * covariance * scale.cwiseInverse().asDiagonal();
  const MatrixXd root = correlation.llt().matrixL().solve(MatrixXd::Identity(count, count)) * scale.cwiseInverse().asDiagonal();
  for (Index a = 0; a < count; ++a)
    for (Index b = 0; b < count; ++b) prior.root(known[static_cast<std::size_t>(a)], known[static_cast<std::size_t>(b)]) = root(a, b);
  for (Index k = 0; k < model.circulation().rate.size(); ++k) {
    const Index j = model.circulation_parameter(k);
    prior.mean[j] = 0;
    prior.root(j, j) = 1 / prior_amplitude;
  }
  return prior;
}

double cost(const RunResidual& residual, const Prior& prior, const VectorXd& theta) {
  return residual.evaluate(theta, Partials::none).chi2 + (prior.root * (theta - prior.mean)).squaredNorm();
}

/// Gauss-Newton with halved steps over the parameters in `free`.
VectorXd minimise(const RunResidual& residual, const Prior& prior, VectorXd theta, const std::vector<Index>& free) {
  constexpr int most_steps = 12;
  double now = cost(residual, prior, theta);
  for (int iteration = 0; iteration < most_steps; ++iteration) {
    const RunResidual::Evaluation e = residual.evaluate(theta, Partials::all);
    MatrixXd rows(e.jacobian.rows() + prior.root.rows(), static_cast<Index>(free.size()));
    VectorXd right(rows.rows());
    right << -e.residual, -(prior.root * (theta - prior.mean));
    for (std::size_t i = 0; i < free.size(); ++i) rows.col(static_cast<Index>(i)) << e.jacobian.col(free[i]), prior.root.col(free[i]);
    const VectorXd move = rows.colPivHouseholderQr().solve(right);
    double fraction = 1;
    VectorXd next = theta;
    double then = now;
    for (int halving = 0; halving < 8; ++halving, fraction /= 2) {
      next = theta;
      for (std::size_t i = 0; i < free.size(); ++i) next[free[i]] += fraction * move[static_cast<Index>(i)];
      then = cost(residual, prior, next);
      if (then < now) break;
    }
    if (!(then < now)) break;
    const double gain = now - then;
    theta = next;
    now = then;
    if (gain < 1e-3) break;  // of a chi-square whose own scatter is some tens
  }
  return theta;
}

/// Standard deviation of a row-wise linear function of (theta, c): rows_theta d theta + rows_c d c, with c following theta.
VectorXd standard_deviation(const MatrixXd& rows_theta, const MatrixXd& rows_c, const RunResidual::Evaluation& e, const MatrixXd& theta_root) {
  const MatrixXd total = rows_theta + rows_c * e.linear_slope;
  const MatrixXd by_theta = total * theta_root;
  const MatrixXd by_c = e.linear_factor.triangularView<Eigen::Upper>().transpose().solve(rows_c.transpose());
  return (by_theta.rowwise().squaredNorm() + by_c.colwise().squaredNorm().transpose()).cwiseSqrt();
}

/// A square root of the covariance of theta: columns span what data and prior leave open; zero for parameters nobody knows anything of.
MatrixXd covariance_root(const RunResidual::Evaluation& e, const Prior& prior) {
  const Index n = e.jacobian.cols();
  MatrixXd rows(e.jacobian.rows() + n, n);
  rows << e.jacobian, prior.root;
  const VectorXd scale = rows.colwise().norm().transpose();
  std::vector<Index> used;
  for (Index j = 0; j < n; ++j)
    if (scale[j] > 0) used.push_back(j);
  MatrixXd scaled(rows.rows(), static_cast<Index>(used.size()));
  for (std::size_t i = 0; i < used.size(); ++i) scaled.col(static_cast<Index>(i)) = rows.col(used[i]) / scale[used[i]];
  const Eigen::HouseholderQR<MatrixXd> qr(scaled);
  const Index m = scaled.cols();
  const MatrixXd inverse = qr.matrixQR().topRows(m).triangularView<Eigen::Upper>().solve(MatrixXd::Identity(m, m));
  MatrixXd root = MatrixXd::Zero(n, m);
  for (std::size_t i = 0; i < used.size(); ++i) root.row(used[i]) = inverse.row(static_cast<Index>(i)) / scale[used[i]];
  return root;
}

IndicialResponse indicial_response(const AeroelasticModel& model, const VectorXd& theta, const MatrixXd& root, double inflation, double longest) {
  constexpr Index per_decade = 40;
  constexpr double shortest = 0.01;
  const Index count = static_cast<Index>(std::ceil(per_decade * std::log10(longest / shortest))) + 1;
  IndicialResponse r{VectorXd(count), VectorXd(count), VectorXd(count)};
  for (Index i = 0; i < count; ++i) {
    r.semichords[i] = shortest * std::pow(longest / shortest, static_cast<double>(i) / static_cast<double>(count - 1));
    VectorXd row = VectorXd::Zero(theta.size());
    r.value[i] = 1;
    for (Index k = 0; k < model.circulation().rate.size(); ++k) {
      const double decay = std::exp(-model.circulation().rate[k] * r.semichords[i]);
      r.value[i] -= model.circulation_amplitude(theta, k) * decay;
      row[model.circulation_parameter(k)] = -decay;
    }
    r.std[i] = inflation * (root.transpose() * row).norm();
  }
  return r;
}

double trusted_from(const IndicialResponse& r) {
  for (Index i = r.value.size() - 1; i >= 0; --i)
    if (!(r.std[i] < 0.05 * std::abs(r.value[i]))) return i + 1 < r.value.size() ? r.semichords[i + 1] : std::numeric_limits<double>::infinity();
  return r.semichords[0];
}

}  // namespace

CorrectResult correct(const CorrectProblem& problem) {
  const Run& run = problem.run;
  if (problem.rig.is_modal()) throw InputError({problem.rig.file, 0}, "a rig known only as modes", "wanted a rig with a section and strips", "Describe the section: without it there is no load to separate.");
  if (!run.find("alpha")) throw InputError({run.file, 0}, "no column 'alpha'", "wanted the measured angle of attack", "Record the angle beside the gauge.");
  if (!(run.speed > 0)) throw InputError({run.file, 0}, "speed 0", "wanted a run in a stream", "Circulation needs a stream; free decays are for `unrig fit`.");

  CorrectResult result;
  result.file = run.file;
  result.start = run.start;
  result.dt = run.dt;
  result.semichords_per_second = run.speed / problem.rig.semichord();
  result.warnings = run.warnings;
  result.prior_amplitude = prior_amplitude;

  const std::vector<MotionBasis::Window> windows = motion_windows(run);
  if (windows.empty()) throw NoAnswer(fmt::format("{}: the angle does not move by more than its noise; nothing can be said about how circulation builds up", run.file));
  const double onset = static_cast<double>(moving(run.channel("alpha").value, noise_level(run.channel("alpha").value)).front().first);
  const double length = (static_cast<double>(run.samples()) - onset) * run.dt * result.semichords_per_second;

  // The coupled model with a free build-up of circulation.
  const VectorXd rates = rates_for(length);
  const Basis basis = problem.fit.normal_modes > 0 ? make_basis(problem.rig, problem.fit.normal_modes, problem.fit.torsion_modes)
                                                   : make_basis(problem.rig, 0.5 / run.dt, run.density);
  const AeroelasticModel model =
      AeroelasticModel(problem.rig, basis, {"free", wagner_amplitudes(rates, length), rates}, AeroelasticModel::Circulation::free).with_effects(problem.fit.effects);
  for (const Parameter& p : model.parameters())
    if (!p.per_run && !problem.fit.find(p.name, run.file))
      throw InputError({problem.fit.file, 0}, "no parameter \"" + p.name + "\"", "wanted a fit of the rig " + problem.rig.file, "Fit this rig to its free decays and steps first.");
  VectorXd theta = theta_for(model, problem.fit, run.file);
  const Prior prior = prior_of(model, problem.fit, theta, run.file);

  RunResidual residual(model, run, windows);
  std::vector<Index> circulation{model.index("normal_force_slope")};
  for (Index k = 0; k < rates.size(); ++k) circulation.push_back(model.circulation_parameter(k));
  residual.differentiate_only(circulation);
  theta = minimise(residual, prior, theta, circulation);
  residual.settle_noise(theta);
  residual.reject_spikes(theta);
  residual.set_motion_prior(motion_prior(residual, theta));
  theta = minimise(residual, prior, theta, circulation);

  // Uncertainty: the rig's parameters move within their covariance, the motion and the circulation with them.
  residual.differentiate_only({});
  const RunResidual::Evaluation e = residual.evaluate(theta, Partials::all);
  const MatrixXd root = covariance_root(e, prior);
  result.reduced_chi2 = e.chi2 / static_cast<double>(residual.degrees_of_freedom() - rates.size() - 1);
  const double inflation = std::sqrt(std::max(1.0, result.reduced_chi2));

  const Index motion_unknowns = residual.motion().unknowns();
  const VectorXd u = e.linear.head(motion_unknowns);
  const RigidLoad load = rigid_load(model, residual.conditions(), theta, residual.motion(), run.dt, u);
  const Index offset = residual.first_offset();  // the gauge comes first among the channels
  const double gauge = problem.rig.station[problem.rig.gauge_element - 1], lever = problem.rig.station[problem.rig.calibration_element - 1] - gauge;
  double arms = 0;
  for (int element : problem.rig.submerged) arms += std::max(0.0, problem.rig.station[element - 1] - gauge) / lever;
  const double steady_per_reading = static_cast<double>(problem.rig.submerged.size()) / arms;  // force per reading for a load even over the strips

  const auto columns = [&](const MatrixXd& by_motion) {
    MatrixXd all = MatrixXd::Zero(run.samples(), residual.linear_unknowns());
    all.leftCols(motion_unknowns) = by_motion;
    all.col(offset).setConstant(steady_per_reading);
    return all;
  };
  const double steady = steady_per_reading * e.linear[offset];
  result.circulatory = load.circulatory.array() + steady;
  result.normal_force = load.normal_force.array() + steady;
  result.circulatory_std = inflation * standard_deviation(load.circulatory_by_theta, columns(load.circulatory_by_motion), e, root);
  result.normal_force_std = inflation * standard_deviation(load.normal_force_by_theta, columns(load.normal_force_by_motion), e, root);
  result.gauge = run.channel("gauge").value;
  result.noise = residual.sigma(0);
  result.force_per_coefficient = run.density * run.speed * run.speed * problem.rig.semichord() * problem.rig.strip_length * static_cast<double>(problem.rig.submerged.size());

  const Motion motion = motion_of(residual.motion().coefficients(u), run.dt);
  result.step = motion.angle[motion.angle.size() - 1];
  Index first = 0;
  while (first + 1 < motion.angle.size() && std::abs(motion.angle[first]) < 3e-3 * motion.angle.cwiseAbs().maxCoeff()) ++first;
  result.onset = run.time(first);
  result.slope = theta[model.index("normal_force_slope")];
  result.slope_std = inflation * root.row(model.index("normal_force_slope")).norm();
  result.indicial = indicial_response(model, theta, root, inflation, length);
  result.trusted_from = trusted_from(result.indicial);
  return result;
}

}  // namespace unrig
