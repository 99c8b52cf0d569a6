#include "correct/long_motion/restless_correction.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <numeric>
#include <optional>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "correct/long_motion/restless_run.h"
#include "correct/estimate/uncertainty_budget.h"

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::RowVectorXd;
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

/// The first so many samples of a run.
Run beginning_of(Run run, Index samples) {
  for (Channel& channel : run.channels) channel.value.conservativeResize(samples);
  return run;
}

/// How many samples are enough to begin a search with: as many as the shaft moves in as it does in the whole record, by the mean square of its changes over some thousand samples.
Index enough_to_begin_with(const Run& run, std::vector<std::string> channels) {
  constexpr Index few = 1 << 15, lag = 1 << 10;
  constexpr double alike = 0.25;
  const VectorXd& alpha = run.channel("alpha").value;
  channels.emplace_back("alpha");
  const auto changes = [&](Index samples) {
    double squares = 0, count = 1;
    for (Index k = lag; k < samples; ++k)
      if (const double change = alpha[k] - alpha[k - lag]; std::isfinite(change)) squares += change * change, count += 1;
    return squares / count;
  };
  const auto read = [&](Index samples) {  // every channel has readings there
    return std::all_of(channels.begin(), channels.end(), [&](const std::string& name) { return noise_level(run.channel(name).value.head(samples)) > 0; });
  };
  const double whole = changes(run.samples());
  Index samples = few;
  while (2 * samples < run.samples() && !(changes(samples) > alike * whole && read(samples))) samples *= 2;
  return 2 * samples < run.samples() ? samples : run.samples();
}

/// minimise(), with missing readings as they are best at what it finds: searched again as long as that changes them.
Search minimise_with_gaps(RestlessRun& run, const AeroelasticModel& model, const Prior& prior, VectorXd theta, double well, bool learn) {
  constexpr int most = 10;
  constexpr double same = 0.1, slowest = 0.95;  // of chi-square: a third of a standard deviation
  double before = INFINITY;
  for (int round = 1;; ++round) {
    Search search = minimise(searched(run, model, prior), prior, theta, well, learn);
    theta = search.solution.theta;
    const double fall = run.settle_missing(theta), again = std::min(slowest, fall / before);  // each fall this share of the one before
    if (round == most || !(fall * std::max(1.0, again / (1 - again)) >= same)) return search;
    before = fall;
  }
}

/// The best theta with noise levels, roughness of the motion and weight of the regularisation learned on the way: of a long record first on its beginning, so that all of it is gone
/// through a few times only.
Search estimate(RestlessRun& run, const AeroelasticModel& model, const RestlessProblem& problem) {
  constexpr double roughly = 10, well = 1e-2;  // of a chi-square whose own scatter is some hundreds
  VectorXd theta = problem.start;
  Prior prior = problem.prior;
  const Run first = beginning_of(problem.run, enough_to_begin_with(problem.run, model.output_channels(problem.run)));
  const bool in_parts = first.samples() < problem.run.samples();
  std::optional<RestlessRun> beginning;
  if (in_parts) beginning.emplace(model, first);
  RestlessRun& part = in_parts ? *beginning : run;
  part.settle_missing(theta);
  theta = minimise(searched(part, model, prior), prior, theta, roughly, false).solution.theta;
  part.settle_noise(theta);
  part.settle_roughness(theta, RestlessRun::Look::everywhere);
  if (in_parts) {
    const Search search = minimise(searched(part, model, prior), prior, theta, well, true);
    theta = search.solution.theta;
    prior.amplitude = search.prior.amplitude;
    if (!std::isfinite(run.solve(theta).chi2)) theta = problem.start;  // it grows too slowly to be seen in a part
    run.settle_noise(theta);  // before it is held to the roughness of a part: where the motion is rougher elsewhere, its readings would be taken for spikes
    run.take_roughness_of(part);
    run.settle_roughness(theta, RestlessRun::Look::near);
    beginning.reset();
  }
  run.settle_noise(theta);
  run.settle_roughness(theta, RestlessRun::Look::near);
  run.settle_missing(theta);
  return minimise_with_gaps(run, model, prior, theta, well, true);
}

/// How the readings and the loads move with z = (theta, linear unknowns), and what the smoother leaves of that.
struct Slopes {
  std::vector<Index> at;                     ///< samples looked at
  std::array<Eigen::MatrixXf, loads> load;   ///< D there, by z
  std::array<VectorXd, loads> by_reading;    ///< there, of a reading that is too high by all of itself, for given z
  MatrixXd gauge_information, angle_information;  ///< what each noise shares of cov(z): e' e, e = what the smoother leaves over the noise
  VectorXd answer_to_reading;                ///< innovations of z times those of that reading
};

/// A load over the filter's states.
RowVectorXd load_row(const RestlessRun& run, const RestlessRun::Point& point, Index load) { return run.row(point.system.C.value.row(run.outputs() + load)); }

Slopes slopes_of(const RestlessRun& run, const RestlessRun::Point& point, double steady) {
  const Index n = run.samples(), channels = run.outputs() + 1, parameters = point.theta.size(), count = parameters + point.linear.size();
  const SettledSmoother& smoother = *point.smoother;
  std::vector<SettledSmoother::Quantity> quantities;  // loads, then readings
  for (Index l = 0; l < loads; ++l) quantities.push_back(smoother.quantity(load_row(run, point, l)));
  for (Index c = 0; c < channels; ++c) quantities.push_back(smoother.quantity(smoother.filter().C.row(c)));
  std::vector<const SettledSmoother::Quantity*> looked_at;
  for (const SettledSmoother::Quantity& q : quantities) looked_at.push_back(&q);

  Slopes s;
  const auto [at, weight] = run.looked();
  s.at = at;
  const auto rows = static_cast<Index>(s.at.size());
  const VectorXd root = weight.cwiseSqrt();
  const VectorXd motion = run.motion(point);
  MatrixXd white_reading;
  {  // the reading as the model has it
    MatrixXd reading = MatrixXd::Zero(n, channels);
    reading.col(0) = smoother.smoothed({looked_at[loads]}, point.left, point.white);
    for (Index j = 0; j < point.linear.size(); ++j) reading.col(0) += point.linear[j] * run.column(point, j).col(0);
    SettledSmoother::Series of_reading = smoother.series(std::move(reading));
    const MatrixXd by_reading = smoother.smoothed({looked_at[0], looked_at[1]}, of_reading.measured, of_reading.white, s.at);
    for (std::size_t l = 0; l < loads; ++l) s.by_reading[l] = by_reading.col(static_cast<Index>(l));
    white_reading = std::move(of_reading.white);
  }

  for (Eigen::MatrixXf& D : s.load) D.resize(rows, count);
  s.answer_to_reading.resize(count);
  std::vector<Eigen::MatrixXf> left(static_cast<std::size_t>(channels), Eigen::MatrixXf(rows, count));
  const auto take = [&](Index j, const SettledSmoother::Series& series, const MatrixXd& direct) {
    const MatrixXd smoothed = smoother.smoothed(looked_at, series.measured, series.white, s.at);
    for (Index l = 0; l < loads; ++l) s.load[static_cast<std::size_t>(l)].col(j) = (direct.col(l) - smoothed.col(l)).cast<float>();
    for (Index c = 0; c < channels; ++c)
      left[static_cast<std::size_t>(c)].col(j) = ((series.measured.col(c)(s.at) - smoothed.col(loads + c)).cwiseProduct(root) / run.sigma()[c]).cast<float>();
    s.answer_to_reading[j] = series.white.cwiseProduct(white_reading).sum();
  };
  run.slopes(point, motion, all_of(parameters), s.at, [&](Index j, RestlessRun::Slope slope) { take(j, smoother.series(std::move(slope.readings)), slope.loads); });
  for (Index j = 0; j < point.linear.size(); ++j) take(parameters + j, smoother.series(run.column(point, j)), MatrixXd::Constant(rows, loads, j == 0 ? steady : 0));

  s.gauge_information = s.angle_information = MatrixXd::Zero(count, count);
  constexpr Index block = 4096;  // sums in double precision
  for (Index c = 0; c < channels; ++c)
    for (Index first = 0; first < rows; first += block) {
      const MatrixXd some = left[static_cast<std::size_t>(c)].middleRows(first, std::min(block, rows - first)).cast<double>();
      (c + 1 < channels ? s.gauge_information : s.angle_information).noalias() += some.transpose() * some;
    }
  return s;
}

/// Values at some samples, at all of them: by the parabola through the nearest three, which meets `least` at worst.
VectorXd between(const VectorXd& value, const std::vector<Index>& at, double least) {
  VectorXd all(at.back() + 1);
  const auto last = static_cast<Index>(at.size()) - 1;
  if (last < 2 || last + 1 == all.size()) return value.cwiseMax(least);
  Index i = 1;
  for (Index k = 0; k < all.size(); ++k) {
    while (i + 1 < last && 2 * k > at[static_cast<std::size_t>(i)] + at[static_cast<std::size_t>(i) + 1]) ++i;
    const auto x = [&](Index j) { return static_cast<double>(at[static_cast<std::size_t>(j)]); };
    const double t = static_cast<double>(k), a = x(i - 1), b = x(i), c = x(i + 1);
    all[k] = std::max(least, value[i - 1] * (t - b) * (t - c) / ((a - b) * (a - c)) + value[i] * (t - a) * (t - c) / ((b - a) * (b - c)) + value[i + 1] * (t - a) * (t - b) / ((c - a) * (c - b)));
  }
  return all;
}

/// Covariance of the errors of neighbouring samples over their variance, far from the ends and for given z: the error's spectrum is |l|^2 over the precision of a spline's coefficient, with l what
/// a spline does to the load.
double neighbours_alike(const RestlessRun& run, const RestlessRun::Point& point, Index load) {
  const Convolution& convolution = point.smoother->convolution();
  const Response spline = spline_response(point.system, exact_step(point.system, run.dt()), convolution.near(), {});
  const VectorXd none = VectorXd::Zero(convolution.far());  // what is left of a spline behind that is the same for neighbours
  const VectorXd power = convolution.kernel(spline.output.col(run.outputs() + load), none).fine.cwiseAbs2().cwiseQuotient(point.precision);
  VectorXd beside(power.size());
  for (Index k = 0; k < power.size(); ++k) beside[k] = power[k] * std::cos(2 * std::acos(-1.0) * static_cast<double>(k) / static_cast<double>(convolution.length()));
  return convolution.mean(beside) / convolution.mean(power);
}

/// By how much the motion's variance of w is larger around each sample than in the whole record: 1 where it is not clearly so. What the roughness of the motion leaves open of the load
/// goes with it, since the smoother's error is linear in w. From the smoothed w, differences of the jerk, over blocks of `block` samples, in which some three numbers are determined, each as
/// wide as the wider of its neighbours: a shaft that sets out is rougher than one that swings.
VectorXd rougher_than_the_record(const VectorXd& jerk) {
  constexpr Index block = 50;
  constexpr double clearly = 3;
  const Index n = jerk.size(), blocks = (n - 1) / block;
  VectorXd rougher = VectorXd::Ones(n);
  if (blocks < 3) return rougher;
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

/// Standard deviations of a load, by sources. `in_gaps`: what missing readings add to the variances that the motion leaves, by loads, if anything.
void set_bands(const RestlessRun& run, const RestlessRun::Point& point, Index load, const VectorXd& rougher, const MatrixXd& in_gaps, const Slopes& slopes, const UncertaintyBudget& budget, double calibration, double inflation,
               CorrectedLoad& result) {
  const RowVectorXd over_states = load_row(run, point, load);
  const Eigen::MatrixXf& D = slopes.load[static_cast<std::size_t>(load)];
  const VectorXd& by_reading = slopes.by_reading[static_cast<std::size_t>(load)];
  const Index n = run.samples(), channels = run.outputs() + 1, looked_at = static_cast<Index>(slopes.at.size());
  const VectorXd passed = point.smoother->passed_on(point.smoother->quantity(over_states)).cwiseProduct(run.sigma().cwiseAbs2()), variance = point.smoother->variance(over_states);
  const double middle = variance[n / 2], angle = std::clamp(passed[channels - 1] / middle, 0.0, 1.0), gauge = std::clamp(passed.head(channels - 1).sum() / middle, 0.0, 1.0 - angle);
  std::array<double, static_cast<std::size_t>(sources)> share{};
  share[static_cast<std::size_t>(Source::gauge)] = gauge * inflation * inflation;
  share[static_cast<std::size_t>(Source::angle)] = angle * inflation * inflation;
  share[static_cast<std::size_t>(Source::regularisation)] = 1 - gauge - angle;
  const auto of_motion = [&](Index source, Index k) {
    const double by_size = share[static_cast<std::size_t>(source)] * std::max(0.0, variance[k]);
    return static_cast<Source>(source) == Source::regularisation ? (by_size + (in_gaps.size() > 0 ? in_gaps(k, load) * inflation * inflation : 0)) * rougher[k] : by_size;
  };
  const double alike = neighbours_alike(run, point, load);

  MatrixXd of_z(looked_at, sources);  // variances
  double length = 0, before_std = 0;
  RowVectorXd before;
  constexpr Index block = 1024;
  for (Index first = 0; first < looked_at; first += block) {
    const Index count = std::min(block, looked_at - first);
    MatrixXd rows = D.middleRows(first, count).cast<double>() * budget.root();
    rows.col(budget.first_column(Source::calibration)) += calibration * by_reading.segment(first, count);
    for (Index s = 0; s < sources; ++s) of_z.col(s).segment(first, count) = rows.middleCols(budget.first_column(static_cast<Source>(s)), budget.columns(static_cast<Source>(s))).rowwise().squaredNorm();
    for (Index i = 0; i < count; ++i) {  // the angle between neighbours, from the chord
      const Index k = slopes.at[static_cast<std::size_t>(first + i)];
      double motion = 0;
      for (Index s = 0; s < sources; ++s) motion += of_motion(s, k);
      const double std = std::sqrt(of_z.row(first + i).sum() + motion);
      if (before.size() > 0 && std > 0 && before_std > 0) {
        const auto apart = static_cast<double>(k - slopes.at[static_cast<std::size_t>(first + i - 1)]);
        const double off = ((rows.row(i) / std - before / before_std).squaredNorm() + motion * std::pow(1 / std - 1 / before_std, 2)) / (apart * apart) + 2 * motion * (1 - alike) / (std * before_std);
        length += apart * 2 * std::asin(std::min(1.0, std::sqrt(off) / 2));
      }
      before = rows.row(i);
      before_std = std;
    }
  }
  result.by_source.resize(n, sources);
  for (Index s = 0; s < sources; ++s) {
    result.by_source.col(s) = between(of_z.col(s), slopes.at, 0);
    for (Index k = 0; k < n; ++k) result.by_source(k, s) = std::sqrt(result.by_source(k, s) + of_motion(s, k));
  }
  result.std = result.by_source.rowwise().norm();
  result.simultaneous = simultaneous_factor_of_length(length);
}

/// What the user should know before trusting the bands.
void warn(const RestlessRun& run, const RestlessRun::Point& point, double reduced_chi2, double start, CorrectResult& result) {
  constexpr double as_noise = 1;  // tau over the noise of the angle: what the motion does from sample to sample
  if (run.roughness() > as_noise)
    result.warnings.push_back(fmt::format("{}: the shaft moves as fast as it is sampled (its third derivative changes by {:.2g} of the angle's noise from sample to sample); what it does between samples is "
                                          "missing from the load. Sample faster.",
                                          result.file, run.roughness()));
  if (run.longest_gap() > RestlessRun::unnoticed)
    result.warnings.push_back(fmt::format("{}: {} samples are missing from {:.4g} s on while the shaft moves; the load there is what the readings around them make likely, and its band as wide as that.", result.file,
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
      result.no_answer = fmt::format("{}: at the first sample the shaft or the rig moves already, where both must be at rest: what a sample adds there is {:.2f} times what is expected. Load and response "
                                     "are wrong. Begin the record before the motion.",
                                     result.file, std::sqrt(worst));
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
      (half ? load.half_weight : load.twice_weight) = load.value + between((slopes.load[l] * narrow).cast<double>(), slopes.at, -INFINITY);
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

/// What the smoother finds: both loads, what is left of the gauge's readings, and the motion, whose jerk it returns.
VectorXd smoothed_run(const RestlessRun& run, const RestlessRun::Point& point, double steady, CorrectResult& result) {
  const SettledSmoother& smoother = *point.smoother;
  const Index states = smoother.filter().P.rows();
  std::vector<SettledSmoother::Quantity> quantities;
  for (const RowVectorXd& row : {load_row(run, point, 0), load_row(run, point, 1), RowVectorXd(smoother.filter().C.row(0)), RowVectorXd(smoother.filter().C.row(run.outputs())), RowVectorXd(RowVectorXd::Unit(states, states - 1))})
    quantities.push_back(smoother.quantity(row));
  std::vector<const SettledSmoother::Quantity*> all;
  for (const SettledSmoother::Quantity& q : quantities) all.push_back(&q);
  const MatrixXd found = smoother.smoothed(all, point.left, point.white);
  result.circulatory.value = found.col(0).array() + steady * point.linear[0];
  result.normal_force.value = found.col(1).array() + steady * point.linear[0];
  result.unexplained = point.left.col(0) - found.col(2);
  describe_motion(run, found.col(3), result);
  return found.col(4);
}

}  // namespace

void correct_restless(const RestlessProblem& problem, CorrectResult& result) {
  const AeroelasticModel& model = problem.model;
  RestlessRun run(model, problem.run);
  const Search free = estimate(run, model, problem);
  struct Looked {
    RunResidual::Evaluation e;
    Slopes slopes;
    std::optional<UncertaintyBudget> budget;
    double inflation = 1;
  };
  constexpr double least_read = 1e-3;
  const auto look = [&](const Search& search) {
    Looked looked;
    looked.e = search.prior.held.empty() ? search.evaluation : run.differentiate(search.solution, all_of(search.solution.theta.size()));
    const RestlessRun::Point& point = run.at(search.solution.theta);
    looked.slopes = slopes_of(run, point, problem.steady_per_reading);
    result.reduced_chi2 = point.chi2 / static_cast<double>(run.observations() - static_cast<Index>(search.prior.free.size()) - point.linear.size());
    looked.inflation = std::sqrt(std::max(1.0, result.reduced_chi2));
    const double read = static_cast<double>(run.whole_samples()) / static_cast<double>(run.samples());  // the slopes take missing samples for readings
    const auto shares = [&](const MatrixXd& F, const MatrixXd& priors) -> UncertaintyBudget::Shares {
      const MatrixXd angle = F.transpose() * looked.slopes.angle_information * F, gauge = F.transpose() * looked.slopes.gauge_information * F;
      return {angle, MatrixXd::Identity(F.cols(), F.cols()) - priors - gauge - angle};
    };
    const auto reading = [&](const MatrixXd& F, const MatrixXd&) -> VectorXd { return F * (F.transpose() * looked.slopes.answer_to_reading); };
    looked.budget.emplace(looked.e, search.prior, shares, reading, result.calibration_uncertainty, looked.inflation / std::sqrt(std::max(read, least_read)));
    return looked;
  };
  IndicialResponse tests;
  Search best = free;
  if (problem.imposed.any()) {
    tests = indicial_response(model, free.solution.theta, *look(free).budget, problem.semichords, result.semichords_per_second);
    constexpr double well = 1e-2;
    const Prior imposed = impose(free.prior, problem.imposed, model, response_semichords(problem.semichords));
    best = minimise_with_gaps(run, model, imposed, free.solution.theta, well, false);
    best.determined = free.determined;
  }
  const VectorXd& theta = best.solution.theta;
  const Looked looked = look(best);
  const RestlessRun::Point& point = run.at(theta);
  result.indicial = indicial_response(model, theta, *looked.budget, problem.semichords, result.semichords_per_second);
  if (problem.imposed.any()) result.indicial.take_tests_of(tests);

  const VectorXd rougher = rougher_than_the_record(smoothed_run(run, point, problem.steady_per_reading, result));
  warn(run, point, result.reduced_chi2, result.start, result);
  MatrixXd rows(loads, load_row(run, point, 0).size());
  for (Index l = 0; l < loads; ++l) rows.row(l) = load_row(run, point, l);
  const MatrixXd in_gaps = run.variance_in_gaps(point, rows);
  run.forget_readings();
  for (Index l = 0; l < loads; ++l) set_bands(run, point, l, rougher, in_gaps, looked.slopes, *looked.budget, result.calibration_uncertainty, looked.inflation, l == 0 ? result.circulatory : result.normal_force);
  vary_weight(best, looked.e, looked.slopes, model, result);

  result.noise = run.sigma()[0];
  const Index slope = model.index("normal_force_slope");
  result.slope = theta[slope];
  result.slope_std = looked.budget->root().row(slope).norm();
  result.prior_amplitude = best.prior.amplitude;
  result.determined = best.determined;
  result.amplitudes = static_cast<Index>(best.prior.amplitudes.size());
  result.in_fit = !best.prior.held.empty();
}

}  // namespace unrig
