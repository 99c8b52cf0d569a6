#include "correct/modal/modal_load.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <complex>
#include <filesystem>
#include <iterator>
#include <limits>
#include <numbers>

#include <fmt/format.h>

#include "core/run/motion.h"
#include "core/propagate/response.h"
#include "core/model/run_inputs.h"
#include "core/run/run_limits.h"
#include "correct/estimate/how_far_to_trust.h"
#include "correct/modal/load_smoother.h"

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// The rig under its inputs, with the load as two more states, and what the inputs do to the reading.
struct Driven {
  LoadModel model;
  VectorXd from_inputs;
  LinearSystem system;    // of the rig and the load
};

/// Covariance that white noise of density one on the last state adds in a step (C. F. Van Loan, IEEE Trans. Autom. Control 23 (1978) 395).
MatrixXd diffusion_of(const MatrixXd& A, double dt) {
  const Index n = A.rows();
  MatrixXd block = MatrixXd::Zero(2 * n, 2 * n);
  block.topLeftCorner(n, n) = -A;
  block.bottomRightCorner(n, n) = A.transpose();
  block(n - 1, 2 * n - 1) = 1;
  const MatrixXd e = exponential(DualMatrix(dt * block)).value;
  const MatrixXd q = e.bottomRightCorner(n, n).transpose() * e.topRightCorner(n, n);
  return 0.5 * (q + q.transpose());
}

Driven driven(const AeroelasticModel& model, const Run& run, const VectorXd& theta, double reading_scale) {
  Conditions conditions = conditions_of(run);
  const bool driven = conditions.force || conditions.mount;
  conditions.force = true;  // the load's way in
  const LinearSystem rig = model.system(conditions, theta, {"gauge"});
  const Index n = rig.states();
  const VectorXd push = rig.B.value.col(0);
  const double steady = rig.D.value(0, 0) - (rig.C.value * rig.A.value.partialPivLu().solve(push))(0);

  Driven result;
  LinearSystem& s = result.system;
  s.A = DualMatrix(MatrixXd::Zero(n + 2, n + 2));
  s.A.value.topLeftCorner(n, n) = rig.A.value;
  s.A.value.col(n).head(n) = push / steady;
  s.A.value(n, n + 1) = 1;
  s.C = DualMatrix(MatrixXd::Zero(1, n + 2));
  s.C.value.leftCols(n) = rig.C.value;
  s.C.value(0, n) = rig.D.value(0, 0) / steady;
  s.B = DualMatrix(MatrixXd::Zero(n + 2, rig.B.cols()));
  s.B.value.topRows(n) = rig.B.value;
  s.D = DualMatrix(rig.D.value);
  s.curved = rig.curved;
  const ExactStep step = exact_step(s, run.dt);
  result.from_inputs = VectorXd::Zero(run.samples());
  if (driven) result.from_inputs = drive(s, step, DualMatrix(MatrixXd::Zero(n + 2, 1)), run.samples(), {}, run_inputs(run, conditions), Partials::none).output.col(0);

  // A start that is unknown by the size of the reading: each mode's displacement that reads so, its rate and the load's over a sample.
  VectorXd scale = VectorXd::Constant(n + 2, reading_scale);
  for (Index i = 0; i < n / 2; ++i) {
    scale[i] = reading_scale / std::max(1e-300, std::abs(s.C.value(0, i)));
    scale[n / 2 + i] = scale[i] / run.dt;
  }
  scale[n + 1] = reading_scale / run.dt;
  result.model = {step.transition.value, diffusion_of(s.A.value, run.dt), s.C.value.row(0), scale};
  return result;
}

/// The roughness that makes the readings most probable: coarse, then fine, over its logarithm.
double most_probable(const LoadModel& model, const VectorXd& reading, double dt) {
  constexpr Index enough = 50000;
  const auto part = reading.head(std::min(enough, reading.size()));
  const auto worth = [&](double logarithm) { return likelihood(model, std::exp(logarithm), part).logarithm; };
  // A load as rough as this moves by a thousandth of the noise in a second, or by a thousand times the noise in a sample.
  const double low = std::log(1e-6), high = std::log(1e6 / std::pow(dt, 3));
  constexpr int coarse = 16;
  double best = low, best_worth = -std::numeric_limits<double>::infinity();
  const double stride = (high - low) / coarse;
  for (int i = 0; i <= coarse; ++i)
    if (const double w = worth(low + i * stride); w > best_worth) best = low + i * stride, best_worth = w;
  for (double width = stride / 2; width > 0.02; width /= 2)
    for (const double at : {best - width, best + width})
      if (const double w = worth(at); w > best_worth) best = at, best_worth = w;
  return std::exp(best);
}

/// Where the load's spectrum q/w^4, seen through the rig, falls to the noise's density r dt.
double bandwidth_of(const LinearSystem& s, double roughness, double dt) {
  const Index n = s.states() - 2;
  const Eigen::MatrixXcd A = s.A.value.topLeftCorner(n, n).cast<std::complex<double>>();
  constexpr int per_decade = 50;
  double bandwidth = 0;
  for (double hertz = 1e-3; hertz < 0.5 / dt; hertz *= std::pow(10, 1.0 / per_decade)) {
    const std::complex<double> iw(0, 2 * std::numbers::pi * hertz);
    const Eigen::MatrixXcd resolvent = iw * Eigen::MatrixXcd::Identity(n, n) - A;
    const Eigen::VectorXcd push = s.A.value.col(n).head(n).cast<std::complex<double>>();
    const double gain = std::norm((s.C.value.leftCols(n).cast<std::complex<double>>() * resolvent.partialPivLu().solve(push))(0) + s.C.value(0, n));
    if (roughness * gain / std::pow(std::abs(iw), 4) < dt) break;
    bandwidth = hertz;
  }
  return bandwidth;
}

/// Square root of the covariance of the parameters, but those that the fit held: where it determines only ratios, errors are those with the rest held.
MatrixXd parameter_root(const AeroelasticModel& model, const FittedRig& fit, const std::string& run) {
  std::vector<Index> place, fitted;
  for (Index j = 0; j < static_cast<Index>(model.parameters().size()); ++j) {
    const FittedParameter* p = fit.find(model.parameters()[static_cast<std::size_t>(j)].name, run);
    if (p && p->std_error > 0 && std::isfinite(p->std_error)) place.push_back(j), fitted.push_back(p - fit.parameters.data());
  }
  MatrixXd root = MatrixXd::Zero(static_cast<Index>(model.parameters().size()), static_cast<Index>(place.size()));
  if (place.empty()) return root;
  VectorXd deviation(static_cast<Index>(fitted.size()));
  for (std::size_t i = 0; i < fitted.size(); ++i) deviation[static_cast<Index>(i)] = fit.parameters[static_cast<std::size_t>(fitted[i])].std_error;
  root(place, Eigen::all) = deviation.asDiagonal() * MatrixXd(MatrixXd(fit.correlation(fitted, fitted)).llt().matrixL());
  return root;
}

}  // namespace

ModalLoad modal_load(const CorrectProblem& problem) {
  const Run& run = problem.run;
  const AeroelasticModel model(problem.rig, {}, {});
  check_is_fit_of(model, problem.fit, run.file);
  if (!problem.fit.effects.empty()) throw InputError({problem.fit.file, 0}, "a fit with effects, of a rig known only as modes", "wanted one without", "");
  model.output_channels(run);  // refuses a run of another rig
  check_what_drives(run);
  check_reading_changes(run, "gauge");
  const VectorXd theta = theta_for(model, problem.fit, run.file);

  ModalLoad result;
  result.file = run.file;
  result.unit = problem.rig.modal.front().gauge_unit;
  result.start = run.start;
  result.dt = run.dt;
  result.gauge = run.channel("gauge").value;
  result.warnings = run.warnings;
  result.calibration_uncertainty = problem.calibration_uncertainty;

  const double noise = noise_level(result.gauge);
  const Driven best = driven(model, run, theta, noise);
  result.from_inputs = best.from_inputs;
  const VectorXd reading = result.gauge - best.from_inputs;
  const double roughness = most_probable(best.model, reading, run.dt);
  const double variance = likelihood(best.model, roughness, reading).noise_variance;
  const SmoothedLoad smoothed = smooth(best.model, roughness, reading);
  result.load = smoothed.load;
  result.half_weight = smooth(best.model, 2 * roughness, reading).load;
  result.twice_weight = smooth(best.model, roughness / 2, reading).load;
  result.noise = std::sqrt(variance);
  result.roughness = std::sqrt(roughness * variance);
  result.bandwidth = bandwidth_of(best.system, roughness, run.dt);

  // Sources. An impulse in the middle of the record shows how the noise of one reading spreads over the load; all readings alike.
  const Index n = run.samples();
  result.by_source = MatrixXd::Zero(n, sources);
  const double passed = smooth(best.model, roughness, VectorXd::Unit(n, n / 2)).load.squaredNorm() * variance;
  const VectorXd whole = smoothed.variance * variance;
  result.by_source.col(static_cast<Index>(Source::gauge)) = whole.cwiseMin(passed).cwiseSqrt();
  result.by_source.col(static_cast<Index>(Source::regularisation)) = (whole.array() - passed).max(0).sqrt();
  result.by_source.col(static_cast<Index>(Source::calibration)) = result.calibration_uncertainty * result.load.cwiseAbs();
  const MatrixXd root = parameter_root(model, problem.fit, run.file);
  VectorXd moved = VectorXd::Zero(n);
  for (Index j = 0; j < root.cols(); ++j) {
    const Driven other = driven(model, run, theta + root.col(j), noise);
    moved += (smooth(other.model, roughness, result.gauge - other.from_inputs).load - result.load).cwiseAbs2();
  }
  result.by_source.col(static_cast<Index>(Source::rig)) = moved.cwiseSqrt();
  result.std = result.by_source.rowwise().norm();
  result.simultaneous = simultaneous_factor_of_length(smoothed.angular_speed.sum() * run.dt);
  return result;
}

constexpr std::array<std::size_t, 4> shares_there{0, 2, 3, 5};  // of share_names: there is no angle, and what the rig file states is not allowed for
static_assert(share_names[0] == std::string_view("gauge") && share_names[2] == std::string_view("calibration") && share_names[3] == std::string_view("parameters"));

std::string to_csv(const ModalLoad& r, const MadeBy& made_by) {
  return whole_text([&](const TextSink& sink) { to_csv(sink, r, made_by); });
}

void to_csv(const TextSink& sink, const ModalLoad& r, const MadeBy& made_by) {
  std::string text = fmt::format("time [s],gauge [{0}],normal_force [{0}],normal_force_std [{0}]", r.unit);
  for (Index s = 0; s < sources; ++s)
    if (s != static_cast<Index>(Source::angle)) text += fmt::format(",normal_force_std_{} [{}]", source_names[static_cast<std::size_t>(s)], r.unit);
  text += fmt::format(",normal_force_band95 [{0}],normal_force_half_weight [{0}],normal_force_twice_weight [{0}],from_inputs [{0}]", r.unit);
  for (const std::size_t share : shares_there) text += fmt::format(",normal_force_share_{}", share_names[share]);
  const HowFarToTrust trust{std::nan(""), r.warnings, {}, made_by};
  sink(text + trust.header() + "\n");
  const std::string last_cells = trust.cells();
  for (Index k = 0; k < r.load.size(); ++k) {
    text.clear();
    auto out = std::back_inserter(text);
    fmt::format_to(out, "{:.9g},", r.start + static_cast<double>(k) * r.dt);
    if (std::isfinite(r.gauge[k])) fmt::format_to(out, "{:.6g}", r.gauge[k]);
    fmt::format_to(out, ",{:.6g},{:.4g}", r.load[k], r.std[k]);
    for (Index s = 0; s < sources; ++s)
      if (s != static_cast<Index>(Source::angle)) fmt::format_to(out, ",{:.3g}", r.by_source(k, s));
    fmt::format_to(out, ",{:.4g},{:.6g},{:.6g},{:.6g}", r.simultaneous * r.std[k], r.half_weight[k], r.twice_weight[k], r.from_inputs[k]);
    const MatrixXd shares = variance_shares(r.by_source.row(k), {});
    for (const std::size_t share : shares_there) {
      const double here = shares(0, static_cast<Index>(share));
      std::isfinite(here) ? fmt::format_to(out, ",{:.6f}", here) : fmt::format_to(out, ",");
    }
    fmt::format_to(out, "{}\n", last_cells);
    sink(text);
  }
}

std::string report(const ModalLoad& r) {
  const auto rms = [](const VectorXd& x) { return x.norm() / std::sqrt(static_cast<double>(x.size())); };
  const auto middle = static_cast<Index>(r.load.size() / 2);
  std::string text = fmt::format("[[Correction]] {}\n", std::filesystem::path(r.file).filename().string());
  text += fmt::format("    the measured inputs account for {:.4g} {} r.m.s. of the reading; its noise is {:.3g} {}\n", rms(r.from_inputs), r.unit, r.noise, r.unit);
  text += fmt::format("    load                 {:.4g} {} r.m.s.\n", rms(r.load), r.unit);
  text += fmt::format("    uncertainty          in the middle of the record [{}]:", r.unit);
  for (Index s = 0; s < sources; ++s)
    if (s != static_cast<Index>(Source::angle)) text += fmt::format(" {} {:.2g}{}", source_names[static_cast<std::size_t>(s)], r.by_source(middle, s), s + 1 < sources ? "," : "\n");
  text += fmt::format("        95 % bands       1.96 standard deviations for a point, {:.2f} for the whole load\n", r.simultaneous);
  text += fmt::format("    regularisation       the most probable: second derivative of the load white, {:.3g} {}/s^1.5\n", r.roughness, r.unit);
  text += fmt::format("        sensitivity      half its weight moves the load by {:.2g} {} r.m.s., twice by {:.2g}\n", rms(r.half_weight - r.load), r.unit, rms(r.twice_weight - r.load));
  text += r.bandwidth > 0 ? fmt::format("    usable bandwidth     up to {:.3g} Hz\n", r.bandwidth) : "    usable bandwidth     none: the load drowns in noise at every frequency\n";
  return text;
}

}  // namespace unrig
