#include "correct/restless_correction.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <numeric>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "correct/restless_run.h"
#include "correct/uncertainty_budget.h"

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::MatrixXf;
using Eigen::RowVectorXd;
using Eigen::VectorXcd;
using Eigen::VectorXd;

constexpr Index loads = 2;  ///< circulatory, normal force

std::vector<Index> all_of(Index count) {
  std::vector<Index> all(static_cast<std::size_t>(count));
  std::iota(all.begin(), all.end(), Index{0});
  return all;
}

/// Readings are nearly linear in slope s and in s A_k, not in s and A_k: an oscillation of one frequency, which says little about the limit of the response, goes a long way along such a bend.
/// A step to s + ds therefore takes A_k to A_k + dA_k s / (s + ds).
Searched searched(const RestlessRun& run, const AeroelasticModel& model, const Prior& prior) {
  Searched by{[&run](const VectorXd& theta) { return run.solve(theta); },
              [&run, free = prior.free](const RunResidual::Solution& solution) { return run.differentiate(solution, free); }};
  if (prior.rising.rows() > 0) return by;  // what is imposed holds along straight lines
  by.advance = [slope = model.index("normal_force_slope"), amplitudes = prior.amplitudes](const VectorXd& theta, const VectorXd& move) -> VectorXd {
    constexpr double most = 2;
    VectorXd next = theta + move;
    const double bend = std::clamp(theta[slope] / next[slope], 1 / most, most);
    for (const Index k : amplitudes) next[k] = theta[k] + bend * move[k];
    return next;
  };
  return by;
}

/// The best theta with noise levels, roughness of the motion and weight of the regularisation learned on the way.
Search estimate(RestlessRun& run, const AeroelasticModel& model, const Prior& prior, const VectorXd& start) {
  constexpr double roughly = 10, well = 1e-2;  // of a chi-square whose own scatter is some hundreds
  const Searched by = searched(run, model, prior);
  const VectorXd theta = minimise(by, prior, start, roughly, false).solution.theta;
  for (int round = 0; round < 2; ++round) {
    run.settle_noise(theta);
    run.settle_roughness(theta);
  }
  return minimise(by, prior, theta, well, true);
}

/// How the readings and the loads move with z = (theta, linear unknowns), and what the smoother leaves of that.
struct Slopes {
  std::array<MatrixXf, loads> load;          ///< D, samples x z
  std::array<VectorXd, loads> by_reading;    ///< of a reading that is too high by all of itself, for given z
  MatrixXd gauge_information, angle_information;  ///< what each noise shares of cov(z): e' e, e = what the smoother leaves over the noise
  VectorXd answer_to_reading;                ///< innovations of z times those of that reading
};

Slopes slopes_of(const RestlessRun& run, const RestlessRun::Point& point, const std::array<SettledSmoother::Quantity, loads>& load, double steady) {
  const Index n = run.samples(), channels = run.outputs() + 1, parameters = point.theta.size(), count = parameters + point.linear.size();
  const SettledSmoother& smoother = *point.smoother;
  std::vector<SettledSmoother::Quantity> outputs;
  for (Index c = 0; c < channels; ++c) outputs.push_back(smoother.quantity(smoother.filter().C.row(c)));
  const SettledSmoother::Series own = smoother.series(point.left);
  const VectorXcd motion = run.convolution().transform(run.motion(point, own));

  // The reading as the model has it.
  MatrixXd reading = MatrixXd::Zero(n, channels);
  reading.col(0) = smoother.smoothed(outputs[0], own);
  for (std::size_t j = 0; j < point.columns.size(); ++j) reading.col(0) += point.linear[static_cast<Index>(j)] * point.columns[j].col(0);
  const SettledSmoother::Series of_reading = smoother.series(reading);

  Slopes s;
  for (std::size_t l = 0; l < loads; ++l) s.load[l].resize(n, count), s.by_reading[l] = smoother.smoothed(load[l], of_reading);
  s.answer_to_reading.resize(count);
  std::vector<MatrixXf> left(static_cast<std::size_t>(channels), MatrixXf(n, count));
  const auto take = [&](Index j, const MatrixXd& y, const MatrixXd& direct) {
    const SettledSmoother::Series series = smoother.series(y);
    for (std::size_t l = 0; l < loads; ++l) s.load[l].col(j) = (direct.col(static_cast<Index>(l)) - smoother.smoothed(load[l], series)).cast<float>();
    for (Index c = 0; c < channels; ++c)
      left[static_cast<std::size_t>(c)].col(j) = ((y.col(c) - smoother.smoothed(outputs[static_cast<std::size_t>(c)], series)) / run.sigma()[c]).cast<float>();
    s.answer_to_reading[j] = series.white.cwiseProduct(of_reading.white).sum();
  };
  MatrixXd y = MatrixXd::Zero(n, channels);
  run.slopes(point, motion, all_of(parameters), [&](Index j, const MatrixXd& slope) {
    y.leftCols(run.outputs()) = slope.leftCols(run.outputs());
    take(j, y, slope.rightCols(loads));
  });
  for (std::size_t j = 0; j < point.columns.size(); ++j) take(parameters + static_cast<Index>(j), point.columns[j], MatrixXd::Constant(n, loads, j == 0 ? steady : 0));

  s.gauge_information = s.angle_information = MatrixXd::Zero(count, count);
  constexpr Index block = 4096;  // sums in double precision
  for (Index c = 0; c < channels; ++c)
    for (Index first = 0; first < n; first += block) {
      const MatrixXd rows = left[static_cast<std::size_t>(c)].middleRows(first, std::min(block, n - first)).cast<double>();
      (c + 1 < channels ? s.gauge_information : s.angle_information).noalias() += rows.transpose() * rows;
    }
  return s;
}

/// Covariance of the errors of neighbouring samples over their variance, far from the ends and for given z: the error's spectrum is |l|^2 / (|g|^2 / r + |a|^2 / r_a + |1 - e^-iw|^8 / tau^2), with
/// l, g and a what a spline does to the load, the readings and the angle.
double neighbours_alike(const RestlessRun& run, const RestlessRun::Point& point, Index load) {
  const Index n = run.samples(), outputs = run.outputs();
  const Convolution& convolution = run.convolution();
  const Response spline = spline_response(point.system, exact_step(point.system, run.dt()), n, {});
  const double tau = run.roughness() * run.sigma()[outputs];
  VectorXd power = convolution.transform(spline.output.col(outputs + load)).cwiseAbs2(), beside(power.size());
  VectorXd information = VectorXd::Zero(power.size());
  for (Index c = 0; c < outputs; ++c) information += convolution.transform(spline.output.col(c)).cwiseAbs2() / std::pow(run.sigma()[c], 2);
  for (Index k = 0; k < power.size(); ++k) {
    const double w = 2 * std::acos(-1.0) * static_cast<double>(k) / static_cast<double>(convolution.length());
    const double angle = (4 + 2 * std::cos(w)) / 6;
    power[k] /= information[k] + std::pow(angle / run.sigma()[outputs], 2) + std::pow(2 - 2 * std::cos(w), 4) / (tau * tau);
    beside[k] = power[k] * std::cos(w);
  }
  return convolution.mean(beside) / convolution.mean(power);
}

/// By how much the motion's variance of w is larger around each sample than in the whole record: 1 where it is not clearly so. What the roughness of the motion leaves open of the load
/// goes with it, since the smoother's error is linear in w. From the smoothed w, differences of the jerk, over blocks of `block` samples, in which some three numbers are determined, each as
/// wide as the wider of its neighbours: a shaft that sets out is rougher than one that swings.
VectorXd rougher_than_the_record(const RestlessRun& run, const RestlessRun::Point& point, const SettledSmoother::Series& own) {
  constexpr Index block = 50;
  constexpr double clearly = 3;
  const Index n = run.samples(), states = point.smoother->filter().P.rows(), blocks = (n - 1) / block;
  VectorXd rougher = VectorXd::Ones(n);
  if (blocks < 3) return rougher;
  const VectorXd jerk = point.smoother->smoothed(point.smoother->quantity(RowVectorXd::Unit(states, states - 1)), own);
  const VectorXd squares = (jerk.tail(n - 1) - jerk.head(n - 1)).cwiseAbs2();
  const double whole = squares.mean();
  VectorXd local(blocks);
  for (Index i = 0; i < blocks; ++i) local[i] = squares.segment(i * block, block).mean() / whole;
  for (Index k = 0; k < n; ++k) {
    const Index own_block = std::min(k / block, blocks - 1), first = std::max<Index>(0, own_block - 1), last = std::min(blocks - 1, own_block + 1);
    if (const double widest = local.segment(first, last - first + 1).maxCoeff(); widest > clearly) rougher[k] = widest;
  }
  return rougher;
}

/// Standard deviations of a load, by sources.
CorrectedLoad with_bands(const RestlessRun& run, const RestlessRun::Point& point, const SettledSmoother::Quantity& quantity, Index load, const VectorXd& rougher, const MatrixXf& D,
                         const VectorXd& by_reading, const UncertaintyBudget& budget, double calibration, double inflation) {
  const Index n = run.samples(), channels = run.outputs() + 1;
  const VectorXd passed = point.smoother->passed_on(quantity).cwiseProduct(run.sigma().cwiseAbs2());
  const double middle = quantity.variance[n / 2], angle = std::clamp(passed[channels - 1] / middle, 0.0, 1.0), gauge = std::clamp(passed.head(channels - 1).sum() / middle, 0.0, 1.0 - angle);
  std::array<double, static_cast<std::size_t>(sources)> share{};
  share[static_cast<std::size_t>(Source::gauge)] = gauge * inflation * inflation;
  share[static_cast<std::size_t>(Source::angle)] = angle * inflation * inflation;
  share[static_cast<std::size_t>(Source::regularisation)] = 1 - gauge - angle;
  const double alike = neighbours_alike(run, point, load);

  CorrectedLoad result;
  result.std.resize(n);
  result.by_source.resize(n, sources);
  double length = 0, before_std = 0;
  RowVectorXd before;
  constexpr Index block = 1024;
  for (Index first = 0; first < n; first += block) {
    const Index count = std::min(block, n - first);
    MatrixXd rows = D.middleRows(first, count).cast<double>() * budget.root();
    rows.col(budget.first_column(Source::calibration)) += calibration * by_reading.segment(first, count);
    const VectorXd variance = quantity.variance.segment(first, count).cwiseMax(0);
    VectorXd motion = VectorXd::Zero(count);  // variance for given z
    for (Index s = 0; s < sources; ++s) {
      const auto source = static_cast<Source>(s);
      const VectorXd of_z = rows.middleCols(budget.first_column(source), budget.columns(source)).rowwise().squaredNorm();
      VectorXd of_motion = share[static_cast<std::size_t>(s)] * variance;
      if (source == Source::regularisation) of_motion = of_motion.cwiseProduct(rougher.segment(first, count)).eval();
      result.by_source.col(s).segment(first, count) = (of_z + of_motion).cwiseSqrt();
      motion += of_motion;
    }
    result.std.segment(first, count) = result.by_source.middleRows(first, count).rowwise().norm();
    for (Index k = 0; k < count; ++k) {  // the angle between neighbours, from the chord
      const double std = result.std[first + k];
      if (before.size() > 0 && std > 0 && before_std > 0) {
        const double off = (rows.row(k) / std - before / before_std).squaredNorm() + motion[k] * (std::pow(1 / std - 1 / before_std, 2) + 2 * (1 - alike) / (std * before_std));
        length += 2 * std::asin(std::min(1.0, std::sqrt(off) / 2));
      }
      before = rows.row(k);
      before_std = std;
    }
  }
  result.simultaneous = simultaneous_factor_of_length(length);
  return result;
}

/// What the user should know before trusting the bands.
void warn(const RestlessRun& run, const RestlessRun::Point& point, double reduced_chi2, double start, CorrectResult& result) {
  constexpr double as_noise = 1;  // tau over the noise of the angle: what the motion does from sample to sample
  if (run.roughness() > as_noise)
    result.warnings.push_back(fmt::format("{}: the shaft moves as fast as it is sampled (its third derivative changes by {:.2g} of the angle's noise from sample to sample); what it does between samples is "
                                          "missing from the load. Sample faster.",
                                          result.file, run.roughness()));
  constexpr Index unnoticed = 5;
  if (run.longest_gap() > unnoticed)
    result.warnings.push_back(fmt::format("{}: {} samples are missing from {:.4g} s on while the shaft moves; the band there is too narrow. Correct the parts before and behind by themselves.", result.file,
                                          run.longest_gap(), run.longest_gap_at()));
  // Where the record is rougher than one tau for all of it allows, the innovations are larger: over a few knots, or over parts of the record.
  const Index n = run.samples();
  constexpr Index few = 50, parts = 20;
  constexpr double chance = 6, matters = 2, matters_for_few = 4;  // a start or a faster part is no reason to warn: the band knows of it
  for (const Index length : {few, n / parts}) {
    const double scatter = std::sqrt(2.0 / static_cast<double>(length * point.white.cols())), most = std::max(length == few ? matters_for_few : matters, 1 + chance * scatter) * std::max(1.0, reduced_chi2);
    double worst = 0, worst_at = 0, affected = 0;
    for (Index first = 0; first + length <= n; first += length) {
      const double mean = point.white.middleRows(first, length).squaredNorm() / static_cast<double>(length * point.white.cols());
      if (mean > most) affected += static_cast<double>(length) / static_cast<double>(n);
      if (mean > worst) worst = mean, worst_at = start + static_cast<double>(first) * run.dt();
    }
    if (worst <= most) continue;
    if (worst_at == start) {
      result.warnings.push_back(fmt::format("{}: at the first sample the shaft or the rig moves already, where both must be at rest: what a sample adds there is {:.2f} times what is expected. Load and response "
                                            "are wrong. Begin the record before the motion.",
                                            result.file, std::sqrt(worst)));
      return;
    }
    result.warnings.push_back(fmt::format("{}: in {:.2g} % of the record, most of all from {:.4g} s on, the readings follow the model less well than elsewhere: over {:.3g} s there what a sample adds is {:.2f} times "
                                          "what is expected. The motion, or something that the model lacks, is rougher there and the band may be too narrow. Correct that part by itself.",
                                          result.file, 100 * affected, worst_at, static_cast<double>(length) * run.dt(), std::sqrt(worst)));
    return;
  }
}

/// The answers at half and at twice the weight of the regularisation, by one step from the best.
void vary_weight(const Search& best, const RunResidual::Evaluation& e, const Slopes& slopes, const AeroelasticModel& model, CorrectResult& result) {
  const VectorXd& theta = best.solution.theta;
  for (const bool half : {true, false}) {
    Prior prior = best.prior;
    prior.amplitude *= half ? std::sqrt(2.0) : std::sqrt(0.5);
    VectorXd move(theta.size() + e.linear.size());
    const VectorXd of_theta = gauss_newton_step(best.evaluation, prior, theta);
    move << of_theta, e.linear_slope * of_theta;
    const Eigen::VectorXf narrow = move.cast<float>();
    for (std::size_t l = 0; l < loads; ++l) {
      CorrectedLoad& load = l == 0 ? result.circulatory : result.normal_force;
      (half ? load.half_weight : load.twice_weight) = load.value + (slopes.load[l] * narrow).cast<double>();
    }
    (half ? result.indicial.half_weight : result.indicial.twice_weight) = indicial_values(model, theta + of_theta, result.indicial.semichords);
  }
}

/// Where the angle has made its first 0.3 %, and its last value.
void describe_motion(const RestlessRun& run, const VectorXd& angle, CorrectResult& result) {
  Index first = 0;
  while (first + 1 < angle.size() && std::abs(angle[first]) < 3e-3 * angle.cwiseAbs().maxCoeff()) ++first;
  result.onset = result.start + static_cast<double>(first) * run.dt();
  result.step = angle[angle.size() - 1];
}

}  // namespace

void correct_restless(const RestlessProblem& problem, CorrectResult& result) {
  const AeroelasticModel& model = problem.model;
  RestlessRun run(model, problem.run);
  const Search free = estimate(run, model, problem.prior, problem.start);
  Search best = free;
  if (problem.imposed.any()) {
    constexpr double well = 1e-2;
    const Prior imposed = impose(free.prior, problem.imposed, model, response_semichords(problem.semichords));
    best = minimise(searched(run, model, imposed), imposed, free.solution.theta, well, false);
    best.determined = free.determined;
  }
  const VectorXd& theta = best.solution.theta;

  struct Looked {
    RunResidual::Evaluation e;
    Slopes slopes;
    std::optional<UncertaintyBudget> budget;
    double inflation = 1;
  };
  const auto load_quantities = [&](const RestlessRun::Point& point) {
    return std::array<SettledSmoother::Quantity, loads>{point.smoother->quantity(run.row(point.system.C.value.row(run.outputs()))), point.smoother->quantity(run.row(point.system.C.value.row(run.outputs() + 1)))};
  };
  const auto look = [&](const Search& search) {
    Looked looked;
    looked.e = run.differentiate(search.solution, all_of(theta.size()));
    const RestlessRun::Point& point = run.at(search.solution.theta);
    looked.slopes = slopes_of(run, point, load_quantities(point), problem.steady_per_reading);
    result.reduced_chi2 = looked.e.chi2 / static_cast<double>(run.observations() - static_cast<Index>(search.prior.free.size()) - point.linear.size());
    looked.inflation = std::sqrt(std::max(1.0, result.reduced_chi2));
    const auto shares = [&](const MatrixXd& F, const MatrixXd& priors) -> UncertaintyBudget::Shares {
      const MatrixXd angle = F.transpose() * looked.slopes.angle_information * F, gauge = F.transpose() * looked.slopes.gauge_information * F;
      return {angle, MatrixXd::Identity(F.cols(), F.cols()) - priors - gauge - angle};
    };
    const auto reading = [&](const MatrixXd& F, const MatrixXd&) -> VectorXd { return F * (F.transpose() * looked.slopes.answer_to_reading); };
    looked.budget.emplace(looked.e, search.prior, shares, reading, result.calibration_uncertainty, looked.inflation);
    return looked;
  };
  IndicialResponse tests;
  if (problem.imposed.any()) tests = indicial_response(model, free.solution.theta, *look(free).budget, problem.semichords, result.semichords_per_second);
  const Looked looked = look(best);
  const RestlessRun::Point& point = run.at(theta);
  result.indicial = indicial_response(model, theta, *looked.budget, problem.semichords, result.semichords_per_second);
  if (problem.imposed.any()) result.indicial.take_tests_of(tests);

  const SettledSmoother::Series own = point.smoother->series(point.left);
  const VectorXd rougher = rougher_than_the_record(run, point, own);
  const std::array<SettledSmoother::Quantity, loads> quantities = load_quantities(point);
  for (std::size_t l = 0; l < loads; ++l) {
    CorrectedLoad& load = l == 0 ? result.circulatory : result.normal_force;
    load = with_bands(run, point, quantities[l], static_cast<Index>(l), rougher, looked.slopes.load[l], looked.slopes.by_reading[l], *looked.budget, result.calibration_uncertainty, looked.inflation);
    load.value = point.smoother->smoothed(quantities[l], own).array() + problem.steady_per_reading * point.linear[0];
  }
  vary_weight(best, looked.e, looked.slopes, model, result);

  const RowVectorXd gauge = point.smoother->filter().C.row(0), angle = point.smoother->filter().C.row(run.outputs());
  result.unexplained = point.left.col(0) - point.smoother->smoothed(point.smoother->quantity(gauge), own);
  describe_motion(run, point.smoother->smoothed(point.smoother->quantity(angle), own), result);
  result.noise = run.sigma()[0];
  const Index slope = model.index("normal_force_slope");
  result.slope = theta[slope];
  result.slope_std = looked.budget->root().row(slope).norm();
  result.prior_amplitude = best.prior.amplitude;
  result.determined = best.determined;
  result.amplitudes = static_cast<Index>(best.prior.amplitudes.size());
  result.in_fit = !best.prior.held.empty();
  warn(run, point, result.reduced_chi2, result.start, result);
}

}  // namespace unrig
