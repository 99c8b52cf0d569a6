#include "fit/apparent_mass/damped_frequencies.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>
#include <stdexcept>

#include <fmt/format.h>

#include "core/run/motion.h"
#include "core/numerics/spectrum.h"
#include "fit/apparent_mass/decay_model.h"

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXcd;
using Eigen::MatrixXd;
using Eigen::VectorXcd;
using Eigen::VectorXd;
using Complex = std::complex<double>;
using std::numbers::pi;

constexpr Index fewest_samples = 32;
constexpr double false_alarm = 1e-3;  // per record
constexpr Index padding = 2;

/// A place to look: where one more pole would lower chi-square, and by how much.
struct PoleCandidate {
  Pole pole;
  double gain = 0;       ///< fall of chi-square that the matched filter promises
  double threshold = 0;  ///< what noise alone reaches once in 1 / false_alarm records
};

/// Exponential windows of the matched filter [1/s]: from hardly any decay in the record to a few samples.
std::vector<double> window_bank(const DecayModel& model) {
  std::vector<double> decays;
  for (double decay = 1 / model.duration(); decay < 0.3 / model.dt(); decay *= 4) decays.push_back(decay);
  return decays;
}

/// Fall of chi-square by a pole, line by line: 2 |sum_k w_k r_k e^(-i omega t_k)|^2 / sum w_k^2, summed over channels. For white noise of unit
/// standard deviation it is chi-square with two degrees per channel.
VectorXd matched_filter(const DecayModel& model, const VectorXd& residual, double decay) {
  const Index n = model.samples();
  const VectorXd window = VectorXd::NullaryExpr(n, [&](Index k) { return std::exp(-decay * model.dt() * static_cast<double>(k)); });
  VectorXd gain = VectorXd::Zero(padding * n / 2 + 1);
  for (Index c = 0; c < model.channels(); ++c)
    gain += 2 / window.squaredNorm() * fourier(window.cwiseProduct(residual.segment(n * c, n)), padding * n).cwiseAbs2();
  return gain;
}

/// What noise alone gives in `matched_filter`, line by line: from the second half of the record, where modes that die soon are gone and
/// modes that live long are lines that a running median passes over.
VectorXd filtered_noise(const DecayModel& model, const VectorXd& residual) {
  const Index n = model.samples(), half = n / 2;
  const VectorXd window = window_weights(Window::hann, half);
  VectorXd power = VectorXd::Zero(padding * n / 2 + 1);
  for (Index c = 0; c < model.channels(); ++c)
    power += 2 / window.squaredNorm() * fourier(window.cwiseProduct(residual.segment(n * c + n - half, half)), padding * n).cwiseAbs2();
  return noise_floor(power, 30 * padding);
}

/// The most promising place for a further pole. `unit`: variance of the white noise in `residual`.
PoleCandidate look_for_pole(const DecayModel& model, const VectorXd& residual, double unit) {
  const std::vector<double> bank = window_bank(model);
  const double degrees = 2.0 * static_cast<double>(model.channels());
  // Tail of chi-square (B. Laurent and P. Massart, Ann. Stat. 28 (2000) 1302), exact for two degrees; all windows and lines count as trials.
  const double trials = static_cast<double>(model.samples()) / 2 * static_cast<double>(bank.size());
  const double log_odds = std::log(trials / false_alarm);
  const double limit = (degrees - 2 + 2 * std::sqrt((degrees - 2) * log_odds) + 2 * log_odds) / degrees;
  const double spacing = 2 * pi / (model.dt() * static_cast<double>(padding * model.samples()));  // rad/s per line
  const VectorXd floor = filtered_noise(model, residual).cwiseMax(degrees * unit);
  PoleCandidate best;
  for (const double decay : bank) {
    const std::vector<Peak> peaks = peaks_above(matched_filter(model, residual, decay), floor, limit);
    if (!peaks.empty() && peaks.front().power > best.gain)
      best = {{spacing * peaks.front().position, decay}, peaks.front().power, limit * floor[peaks.front().line]};
  }
  return best;
}

/// Variance of the white part of the normalised residual: the residual's own where that is noise, and 1, what differences say of the record, while
/// there is clearly more in it. (Differences know the noise of some hundred samples to a tenth or two; they overstate that of a recording that rings
/// close to its Nyquist frequency, but not by more than the square root of two.)
double white_variance(const DecayModel& model, double chi2, std::size_t poles) {
  constexpr double clearly_more = 1.5;
  const auto parameters = static_cast<double>(2 * poles) + static_cast<double>(model.channels()) * static_cast<double>(1 + 2 * poles);
  const double variance = chi2 / std::max(1.0, static_cast<double>(model.observations()) - parameters);
  return variance < clearly_more ? std::max(variance, 0.5) : 1;
}

// While searching, a fit need only be good enough to show what it leaves over.
constexpr double search_precision = 0.3;  // standard errors: chi-square is within 0.1 of its least, and tens decide
constexpr int search_iterations = 8;

/// Takes up poles while the record asks for them. Returns false where `most` did not suffice.
bool find_poles(const DecayModel& model, Index most, std::vector<Pole>& poles) {
  DecayModel::Evaluation now = model.evaluate(poles, false);
  while (true) {
    const PoleCandidate candidate = look_for_pole(model, now.residual, white_variance(model, now.chi2, poles.size()));
    if (candidate.gain == 0) return true;
    if (static_cast<Index>(poles.size()) >= most) return false;
    std::vector<Pole> trial = poles;
    trial.push_back(candidate.pole);
    fit_poles(model, trial, search_precision, search_iterations);
    const DecayModel::Evaluation next = model.evaluate(trial, false);
    if (now.chi2 - next.chi2 < candidate.threshold) return true;
    poles = std::move(trial);
    now = next;
  }
}

/// Takes out again what later poles have made superfluous.
void drop_superfluous(const DecayModel& model, std::vector<Pole>& poles) {
  while (poles.size() > 1) {
    const DecayModel::Evaluation all = model.evaluate(poles, false);
    Index weakest = 0;
    const VectorXd significance = all.significance.rowwise().sum();
    significance.minCoeff(&weakest);
    std::vector<Pole> fewer = poles;
    fewer.erase(fewer.begin() + weakest);
    const double rise = fit_poles(model, fewer, search_precision, search_iterations) - all.chi2;
    const double degrees = 2.0 + 2.0 * static_cast<double>(model.channels());
    const double limit = degrees + 2 * std::log(static_cast<double>(model.samples()) / false_alarm);
    if (rise > limit * white_variance(model, all.chi2, poles.size())) return;
    poles = fewer;
  }
}

/// Covariance of (omega_1, decay_1, omega_2, ...).
MatrixXd pole_covariance(const DecayModel& model, const DecayModel::Evaluation& e) {
  const Index n = model.samples(), unknowns = e.jacobian.cols();
  const auto parameters = static_cast<double>(unknowns + model.channels() * (1 + unknowns));
  const double variance = e.chi2 / std::max(1.0, static_cast<double>(model.observations()) - parameters);
  const VectorXd scale = e.jacobian.colwise().norm().transpose().cwiseMax(1e-300).cwiseInverse();
  const MatrixXd jacobian = e.jacobian * scale.asDiagonal();
  const MatrixXd inverse = (jacobian.transpose() * jacobian).ldlt().solve(MatrixXd::Identity(unknowns, unknowns));

  // Sandwich: the residual's smoothed periodogram in place of its variance. Twice the length makes the products aperiodic.
  MatrixXd middle = MatrixXd::Zero(unknowns, unknowns);
  const Index half_width = std::clamp<Index>(n / 16, 16, 64);  // lines of half the record's resolution
  for (Index c = 0; c < model.channels(); ++c) {
    const VectorXd periodogram = fourier(e.residual.segment(n * c, n), 2 * n).cwiseAbs2() / static_cast<double>(n);
    VectorXd smooth(periodogram.size());
    for (Index k = 0; k < smooth.size(); ++k) {
      const Index first = std::max<Index>(0, k - half_width), last = std::min(smooth.size() - 1, k + half_width);
      smooth[k] = periodogram.segment(first, last - first + 1).mean();
    }
    MatrixXcd lines(smooth.size(), unknowns);
    for (Index j = 0; j < unknowns; ++j) lines.col(j) = fourier(jacobian.block(n * c, j, n, 1), 2 * n);
    VectorXd weight = 2 * smooth / static_cast<double>(2 * n);
    weight[0] /= 2;
    weight[n] /= 2;
    middle += (lines.adjoint() * weight.asDiagonal() * lines).real();
  }
  const MatrixXd robust = inverse * middle * inverse;
  const VectorXd factor = (robust.diagonal().array() / (variance * inverse.diagonal().array())).max(1.0).sqrt().matrix();
  return (scale.cwiseProduct(factor)).asDiagonal() * (variance * inverse) * (scale.cwiseProduct(factor)).asDiagonal();
}

/// Whether two poles ring as one: closer together than their decay rates, or the one grows beside the other, which no vibration of its own does.
bool ring_as_one(const Pole& a, const Pole& b, double duration) {
  // A pole that is damped like a filter's (zeta > 0.3) is wide enough to cover anything, and companion to nothing.
  const auto filter = [](const Pole& p) { return p.decay > 0.3 * std::hypot(p.omega, p.decay); };
  if (filter(a) || filter(b)) return false;
  const double distance = std::abs(a.omega - b.omega);
  const bool grows = std::min(a.decay, b.decay) * duration < -0.3;  // by a third over the record; a tone does not
  return distance < std::abs(a.decay) + std::abs(b.decay) || (grows && distance < 0.1 * std::min(a.omega, b.omega));
}

std::vector<std::vector<std::size_t>> groups_of(const std::vector<Pole>& poles, double duration) {
  std::vector<std::vector<std::size_t>> groups;
  std::vector<bool> taken(poles.size(), false);
  for (std::size_t i = 0; i < poles.size(); ++i) {
    if (taken[i]) continue;
    taken[i] = true;
    groups.push_back({i});
    for (std::size_t next = 0; next < groups.back().size(); ++next) {
      for (std::size_t j = 0; j < poles.size(); ++j) {
        if (taken[j] || !ring_as_one(poles[groups.back()[next]], poles[j], duration)) continue;
        taken[j] = true;
        groups.back().push_back(j);
      }
    }
  }
  return groups;
}

/// Errors of what follows from a pole (omega, decay) with this covariance.
void describe(DampedMode& mode, const Pole& pole, const Eigen::Matrix2d& covariance) {
  const double size = std::hypot(pole.omega, pole.decay), zeta = pole.decay / size, cosine = pole.omega / size;
  const Eigen::Vector2d by_size(cosine, zeta);                            // d |s| / d (omega, decay)
  const Eigen::Vector2d by_zeta(-zeta * cosine / size, cosine * cosine / size);
  const auto error = [&](const Eigen::Vector2d& slope) { return std::sqrt(std::max(0.0, slope.dot(covariance * slope))); };
  mode.frequency = pole.omega / (2 * pi);
  mode.frequency_error = std::sqrt(covariance(0, 0)) / (2 * pi);
  mode.decay = pole.decay;
  mode.decay_error = std::sqrt(covariance(1, 1));
  mode.natural_frequency = size / (2 * pi);
  mode.natural_error = error(by_size) / (2 * pi);
  mode.damping_ratio = zeta;
  mode.damping_ratio_error = error(by_zeta);
}

/// One vibration of several poles, from its momentary frequency and decay, those of z = sum (a - i b) e^(s t), weighted by power: the frequency
/// that it tends to as it dies, from a straight line through frequency over amplitude squared (exact to first order for a stiffness with a
/// cubic part, and level for friction and drag, which leave the frequency as it is); the mean decay. With the squares of their errors: the
/// scatter about the line and a third of the way from the mean frequency to its end; how far the decay wanders.
std::pair<Pole, Eigen::Matrix2d> dying_pole(const DecayModel& model, const std::vector<Pole>& poles, const std::vector<std::size_t>& group,
                                            const VectorXd& amplitude) {
  const Index n = model.samples();
  VectorXd power(n), omega(n), decay(n);
  for (Index k = 0; k < n; ++k) {
    Complex z = 0, rate = 0;
    for (const std::size_t m : group) {
      const auto i = static_cast<Index>(2 * m);
      const Complex s(-poles[m].decay, poles[m].omega);
      const Complex term = Complex(amplitude[1 + i], -amplitude[2 + i]) * std::exp(s * (model.dt() * static_cast<double>(k)));
      z += term;
      rate += s * term;
    }
    power[k] = std::max(std::norm(z), 1e-300);
    omega[k] = (rate / z).imag();
    decay[k] = -(rate / z).real();
  }
  const auto mean = [&](const VectorXd& x) { return power.dot(x) / power.sum(); };
  const auto covariance = [&](const VectorXd& x, const VectorXd& y) { return mean((x.array() - mean(x)).cwiseProduct(y.array() - mean(y)).matrix()); };
  const double spread = covariance(power, power), slope = spread > 0 ? covariance(power, omega) / spread : 0;
  const double end = mean(omega) - slope * mean(power);
  Eigen::Matrix2d error = Eigen::Matrix2d::Zero();
  error(0, 0) = std::max(0.0, covariance(omega, omega) - slope * slope * spread) + std::pow((end - mean(omega)) / 3, 2);
  error(1, 1) = std::max(0.0, covariance(decay, decay));
  return {{end, mean(decay)}, error};
}

}  // namespace

DampedFrequencies damped_frequencies(const DecayProblem& problem) {
  if (problem.signal.rows() < fewest_samples || problem.signal.cols() < 1)
    throw std::invalid_argument(fmt::format("a decay of {} samples; at least {} are needed", problem.signal.rows(), fewest_samples));
  if (!(problem.dt > 0)) throw std::invalid_argument("a decay needs a positive sampling interval");
  DampedFrequencies result;
  result.noise.resize(problem.signal.cols());
  VectorXd sigma(problem.signal.cols());
  for (Index c = 0; c < sigma.size(); ++c) {
    const VectorXd channel = problem.signal.col(c);
    result.noise[c] = noise_level(channel);
    double largest = 0;
    for (Index k = 0; k < channel.size(); ++k)
      if (std::isfinite(channel[k])) largest = std::max(largest, std::abs(channel[k]));
    sigma[c] = std::max(result.noise[c], 1e-9 * largest);  // below that no recording is known, and the round-off here is not white
    if (!(sigma[c] > 0)) throw NoAnswer("a channel is zero throughout");
  }
  const DecayModel model(problem.signal, problem.dt, sigma);

  std::vector<Pole> poles;
  result.complete = find_poles(model, problem.most_poles, poles);
  if (poles.empty()) throw NoAnswer("no vibration stands above the noise");
  drop_superfluous(model, poles);
  fit_poles(model, poles);

  const DecayModel::Evaluation e = model.evaluate(poles, true);
  const MatrixXd covariance = pole_covariance(model, e);
  for (const std::vector<std::size_t>& group : groups_of(poles, model.duration())) {
    DampedMode mode;
    mode.poles = static_cast<int>(group.size());
    mode.amplitude.setZero(model.channels());
    for (Index c = 0; c < model.channels(); ++c) {
      Complex sum = 0;
      for (const std::size_t m : group) {
        const auto i = static_cast<Index>(2 * m);
        sum += Complex(e.amplitude(1 + i, c), -e.amplitude(2 + i, c));
        mode.significance += e.significance(static_cast<Index>(m), c);
      }
      mode.amplitude[c] = std::abs(sum);
    }
    const auto block = [&](std::size_t m) -> Eigen::Matrix2d { return covariance.block<2, 2>(static_cast<Index>(2 * m), static_cast<Index>(2 * m)); };
    if (group.size() == 1) {
      describe(mode, poles[group.front()], block(group.front()));
    } else {
      Index strongest = 0;
      mode.amplitude.cwiseQuotient(sigma).maxCoeff(&strongest);
      auto [dying, wander] = dying_pole(model, poles, group, e.amplitude.col(strongest));
      const auto best = *std::min_element(group.begin(), group.end(), [&](auto a, auto b) { return block(a)(0, 0) < block(b)(0, 0); });
      describe(mode, dying, wander + block(best));
    }
    result.modes.push_back(mode);
  }
  std::sort(result.modes.begin(), result.modes.end(), [](const DampedMode& a, const DampedMode& b) { return a.frequency < b.frequency; });

  result.residual.resize(model.channels());
  result.remainder.resize(model.samples(), model.channels());
  for (Index c = 0; c < model.channels(); ++c) {
    result.remainder.col(c) = sigma[c] * e.residual.segment(model.samples() * c, model.samples());
    const auto count = static_cast<double>((problem.signal.col(c).array().isFinite()).count());
    result.residual[c] = result.remainder.col(c).norm() / std::sqrt(count);
  }
  return result;
}

DampedFrequencies damped_frequencies(const Run& run, const std::vector<std::string>& channels) {
  DecayProblem problem;
  problem.dt = run.dt;
  problem.signal.resize(run.samples(), static_cast<Index>(channels.size()));
  for (std::size_t c = 0; c < channels.size(); ++c) problem.signal.col(static_cast<Index>(c)) = run.channel(channels[c]).value;
  if (run.samples() < fewest_samples)
    throw InputError({run.file, 0}, fmt::format("{} samples", run.samples()), fmt::format("wanted at least {}", fewest_samples),
                     "Record several periods of the decay.");
  try {
    return damped_frequencies(problem);
  } catch (const NoAnswer& e) {
    throw NoAnswer(fmt::format("{}: {}.", run.file, e.what()));
  }
}

}  // namespace unrig
