#include "fit/uncertainty/coloured_noise.h"

#include <algorithm>
#include <cmath>
#include <iterator>

#include "core/numerics/spectrum.h"

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXcd;
using Eigen::MatrixXd;
using Eigen::VectorXcd;
using Eigen::VectorXd;

/// Mean over `half` lines on either side, as far as there are any.
VectorXd running_mean(const VectorXd& lines, Index half) {
  const Index n = lines.size();
  VectorXd sum = VectorXd::Zero(n + 1);
  for (Index k = 0; k < n; ++k) sum[k + 1] = sum[k] + lines[k];
  VectorXd mean(n);
  for (Index k = 0; k < n; ++k) {
    const Index first = std::max<Index>(0, k - half), last = std::min(n, k + half + 1);
    mean[k] = (sum[last] - sum[first]) / static_cast<double>(last - first);
  }
  return mean;
}

/// Power of the residual per line over what the fit leaves of it (`left`, 0 to 1); mean 1 where the residual is what it should be.
VectorXd smoothed_power(const VectorXcd& lines, const VectorXd& left, double samples, Index half) {
  return running_mean(lines.cwiseAbs2() / samples, half).cwiseQuotient(running_mean(left, half));
}

/// 1 - h of each line, over the samples in which there is a residual: what theta takes, by way of the slopes, and the offset that is eliminated. Nothing of the mean, and at least a
/// tenth of the others, because where the fit takes nearly all of the noise, what it leaves tells nothing.
VectorXd left_of_lines(const RunResidual::Sensitivity::PerChannel& channel, const VectorXd& residual, double counted, const MatrixXd& inverse, double offset_variance) {
  const auto there = [&](const auto& column) { return fourier((residual.array() != 0).select(column, 0)); };
  const VectorXcd offset = there(channel.into_offset);
  MatrixXcd slopes(offset.size(), channel.slope.cols());
  for (Index j = 0; j < slopes.cols(); ++j) slopes.col(j) = there(channel.slope.col(j));
  VectorXd taken = slopes.conjugate().cwiseProduct(slopes * inverse).rowwise().sum().real();
  if (offset_variance > 0) taken += offset.cwiseAbs2() / offset_variance;
  VectorXd left = (1 - taken.array() / counted).cwiseMax(0.1);
  left[0] = 0;
  return left;
}

/// Power of an autoregression fitted to the residual (Burg's recursion; order by Akaike's criterion), on the lines of its transform; scaled as smoothed_power is.
/// It is smooth: it does not see that the fit took the noise out of the few lines that tell it the parameters.
VectorXd autoregressive_power(const VectorXd& residual, double counted, Index lines) {
  const Index n = residual.size(), most = std::min<Index>(30, n / 20);
  VectorXd forward = residual, backward = residual, a = VectorXd::Zero(most + 1), best = VectorXd::Unit(most + 1, 0);
  a[0] = 1;
  double error = residual.squaredNorm() / counted, best_error = error, least = counted * std::log(error);
  for (Index order = 1; order <= most; ++order) {
    const auto f = forward.segment(order, n - order), b = backward.segment(order - 1, n - order);
    const double reflection = -2 * f.dot(b) / (f.squaredNorm() + b.squaredNorm());
    const VectorXd next = f + reflection * b, last = b + reflection * f, before = a;
    forward.segment(order, n - order) = next;
    backward.segment(order, n - order) = last;
    for (Index i = 1; i <= order; ++i) a[i] = before[i] + reflection * before[order - i];
    error *= 1 - reflection * reflection;
    if (const double criterion = counted * std::log(error) + 2 * static_cast<double>(order); criterion < least) least = criterion, best = a, best_error = error;
  }
  return best_error * fourier(best, n).head(lines).cwiseAbs2().cwiseInverse();
}

/// Kolmogorov's distribution: P(sqrt(m) D > x).
double kolmogorov(double x) {
  if (x < 0.2) return 1;
  double sum = 0;
  for (int k = 1; k < 100; ++k) sum += (k % 2 ? 1 : -1) * std::exp(-2.0 * k * k * x * x);
  return std::clamp(2 * sum, 0.0, 1.0);
}

}  // namespace

ColouredCovariance coloured_covariance(const RunResidual::Sensitivity& sensitivity, const std::vector<VectorXd>& residuals, const MatrixXd& influence, Index offset, const MatrixXd& inverse) {
  constexpr Index half = 3;  // seven lines: the spectrum to 38 %, standard errors to 19 %, and lines as narrow as a resonance are kept
  ColouredCovariance sum{MatrixXd::Zero(influence.rows(), influence.rows()), VectorXd::Zero(influence.rows())};
  double offset_variance = 0;  // at fixed theta, of white noise
  for (const auto& channel : sensitivity.channels) offset_variance += channel.into_offset.squaredNorm();
  for (std::size_t c = 0; c < residuals.size(); ++c) {
    const VectorXd& residual = residuals[c];
    const auto& channel = sensitivity.channels[c];
    const auto counted = static_cast<double>((residual.array() != 0).count());
    if (counted == 0 || (channel.slope.squaredNorm() == 0 && channel.into_offset.squaredNorm() == 0)) continue;
    const auto samples = static_cast<double>(residual.size());
    const VectorXd power = smoothed_power(fourier(residual), left_of_lines(channel, residual, counted, inverse, offset_variance), counted, half)
                               .cwiseMax(autoregressive_power(residual, counted, residual.size() / 2 + 1));
    MatrixXcd slopes(power.size(), channel.slope.cols());
    for (Index j = 0; j < slopes.cols(); ++j) slopes.col(j) = fourier(channel.slope.col(j));
    VectorXd sides = VectorXd::Constant(power.size(), 2 / samples);  // every line but these two stands for its mirror image too
    sides[0] = 1 / samples;
    if (residual.size() % 2 == 0) sides[sides.size() - 1] = 1 / samples;
    const VectorXd weight = power.cwiseProduct(sides);
    MatrixXcd through = slopes * influence.transpose();
    through.col(offset) += fourier(channel.into_offset);
    sum.covariance += (through.adjoint() * weight.asDiagonal() * through).real();
    for (Index a = 0; a < through.cols(); ++a) {
      // What the power of each single line adds to the variance, by way of all the averages that it is in.
      const VectorXd gain = running_mean(through.col(a).cwiseAbs2().cwiseProduct(sides), half);
      sum.spread[a] += gain.cwiseProduct(power).squaredNorm() / 2;
    }
  }
  return sum;
}

void ColouredCovariance::add(const ColouredCovariance& run) {
  if (covariance.size() == 0) *this = run;
  else covariance += run.covariance, spread += run.spread;
}

MatrixXd ColouredCovariance::with_its_own_error() const {
  const VectorXd freedom = covariance.diagonal().cwiseAbs2().cwiseQuotient(spread.cwiseMax(1e-300)).cwiseMax(4.0);
  const VectorXd factor = freedom.cwiseQuotient((freedom.array() - 2).matrix()).cwiseSqrt();
  return factor.asDiagonal() * covariance * factor.asDiagonal();
}

VectorXd residual_at_rest(const VectorXd& residual, const std::vector<MotionBasis::Phase>& phases, Index unknowns) {
  VectorXd resting = residual;
  for (const MotionBasis::Phase& phase : phases)
    if (phase.moving) resting.segment(phase.samples.first, phase.samples.length()).setZero();
  const auto counted = [](const VectorXd& x) { return static_cast<double>((x.array() != 0).count()); };
  constexpr double enough = 100;  // samples
  const double all = counted(residual), rests = counted(resting);
  if (rests == all) return residual;
  if (rests < enough) return std::sqrt(all / std::max(all - static_cast<double>(unknowns), 0.1 * all)) * residual;
  return resting.squaredNorm() / rests >= residual.squaredNorm() / all ? resting : residual;
}

double evenness(const VectorXd& residual) {
  std::vector<double> size;
  for (const double x : residual)
    if (x != 0) size.push_back(std::abs(x));
  const Eigen::Map<const Eigen::ArrayXd> sizes(size.data(), static_cast<Index>(size.size()));
  if (sizes.size() < 2) return 1;
  const double mean = sizes.mean(), deviation = std::sqrt((sizes - mean).square().mean());
  double sum = 0, furthest = 0;
  for (const double x : size) furthest = std::max(furthest, std::abs(sum += x - mean));
  return deviation > 0 ? kolmogorov(furthest / (deviation * std::sqrt(static_cast<double>(size.size())))) : 1;
}

double whiteness(const std::vector<VectorXd>& residuals) {
  double least = 1;
  for (const VectorXd& residual : residuals) {
    std::vector<double> there;  // without what is left out
    std::copy_if(residual.begin(), residual.end(), std::back_inserter(there), [](double x) { return x != 0; });
    if (there.empty()) continue;
    const VectorXd power = fourier(Eigen::Map<const VectorXd>(there.data(), static_cast<Index>(there.size()))).cwiseAbs2();
    const Index lines = power.size() - 2;  // neither the mean nor the last line
    if (lines < 8) continue;
    const double total = power.segment(1, lines).sum();
    double sum = 0, distance = 0;
    for (Index k = 1; k <= lines; ++k) {
      sum += power[k];
      distance = std::max(distance, std::abs(sum / total - static_cast<double>(k) / static_cast<double>(lines)));
    }
    least = std::min(least, kolmogorov(std::sqrt(static_cast<double>(lines)) * distance));
  }
  return std::min(1.0, least * static_cast<double>(residuals.size()));
}

Line strongest_line(const VectorXd& residual) { return strongest_line(residual, 0, 0.5); }

Line strongest_line(const VectorXd& residual, double from, double to) {
  constexpr Index finer = 2, least = 16, beside = 30;
  const Index n = residual.size();
  if (n < least || residual.isZero(0)) return {};
  const VectorXd power = fourier(residual, finer * n).cwiseAbs2();
  const auto place = [&](double frequency) { return std::clamp<Index>(std::lround(frequency * static_cast<double>(finer * n)), finer, power.size() - finer - 1); };  // neither the mean nor the last
  const Index first = place(from), last = place(to), around_first = place(from - static_cast<double>(beside) / static_cast<double>(n)), around_last = place(to + static_cast<double>(beside) / static_cast<double>(n));
  Index at = 0;
  const double most = power.segment(first, last - first + 1).maxCoeff(&at), all = power.segment(around_first, around_last - around_first + 1).sum() / finer;
  const double independent = static_cast<double>(around_last - around_first + 1) / finer;
  Line line;
  line.place = static_cast<double>(at + first) / static_cast<double>(finer * n);
  line.over_mean = independent * most / all;
  line.p_value = std::min(1.0, static_cast<double>(finer) * independent * std::pow(std::max(0.0, 1 - most / all), independent - 1));
  return line;
}

}  // namespace unrig
