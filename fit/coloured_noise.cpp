#include "fit/coloured_noise.h"

#include <algorithm>
#include <cmath>

#include "core/spectrum.h"

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

/// 1 - h of each line: nothing of the mean, which the offset takes, and at least a tenth of the others, because where the fit takes nearly all of the
/// noise, what it leaves tells nothing.
VectorXd left_of_lines(const MatrixXcd& slopes, const MatrixXd& inverse) {
  const VectorXd leverage = slopes.conjugate().cwiseProduct(slopes * inverse).rowwise().sum().real();
  VectorXd left = (1 - leverage.array()).cwiseMax(0.1);
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

ColouredCovariance coloured_covariance(const RunResidual::Sensitivity& sensitivity, const MatrixXd& influence, const MatrixXd& inverse) {
  constexpr Index half = 3;  // seven lines: the spectrum to 38 %, standard errors to 19 %, and lines as narrow as a resonance are kept
  ColouredCovariance sum{MatrixXd::Zero(influence.rows(), influence.rows()), VectorXd::Zero(influence.rows())};
  for (const auto& channel : sensitivity.channels) {
    const auto counted = static_cast<double>((channel.residual.array() != 0).count());
    if (counted == 0 || channel.slope.squaredNorm() == 0) continue;
    const auto samples = static_cast<double>(channel.residual.size());
    MatrixXcd slopes(channel.residual.size() / 2 + 1, channel.slope.cols());
    for (Index j = 0; j < slopes.cols(); ++j) slopes.col(j) = fourier(channel.slope.col(j));
    const VectorXd power = smoothed_power(fourier(channel.residual), left_of_lines(slopes, inverse / samples), counted, half)
                               .cwiseMax(autoregressive_power(channel.residual, counted, slopes.rows()));
    VectorXd sides = VectorXd::Constant(power.size(), 2 / samples);  // every line but these two stands for its mirror image too
    sides[0] = 1 / samples;
    if (channel.residual.size() % 2 == 0) sides[sides.size() - 1] = 1 / samples;
    const VectorXd weight = power.cwiseProduct(sides);
    const MatrixXcd through = slopes * influence.transpose();
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

double power_at_zero(const VectorXd& residual) {
  const auto counted = static_cast<double>((residual.array() != 0).count());
  const VectorXcd lines = fourier(residual);
  constexpr Index low = 7;
  const Index used = std::min(low, lines.size() - 1);
  if (counted == 0 || used < 1) return 1;
  return std::max(lines.segment(1, used).squaredNorm() / (static_cast<double>(used) * counted), autoregressive_power(residual, counted, 1)[0]);
}

double whiteness(const RunResidual::Sensitivity& sensitivity) {
  double least = 1;
  for (const auto& channel : sensitivity.channels) {
    const VectorXd power = fourier(channel.residual).cwiseAbs2();
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
  return std::min(1.0, least * static_cast<double>(sensitivity.channels.size()));
}

}  // namespace unrig
