#include "fit/coloured_noise.h"

#include <algorithm>
#include <cmath>

#include "core/spectrum.h"

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXcd;
using Eigen::VectorXd;

/// Power of the residual per line, averaged over `half` lines on either side; mean 1 where the residual is what it should be.
VectorXd smoothed_power(const VectorXcd& lines, double samples, Index half) {
  const Index n = lines.size();
  const VectorXd power = lines.cwiseAbs2() / samples;
  VectorXd sum = VectorXd::Zero(n + 1);
  for (Index k = 0; k < n; ++k) sum[k + 1] = sum[k] + power[k];
  VectorXd smooth(n);
  for (Index k = 0; k < n; ++k) {
    const Index first = std::max<Index>(0, k - half), last = std::min(n, k + half + 1);
    smooth[k] = (sum[last] - sum[first]) / static_cast<double>(last - first);
  }
  return smooth;
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

MatrixXd coloured_information(const RunResidual::Sensitivity& sensitivity) {
  constexpr Index half = 3;  // seven lines: the spectrum to 38 %, standard errors to 19 %, and lines as narrow as a resonance are kept
  MatrixXd information;
  for (const auto& channel : sensitivity.channels) {
    const Index parameters = channel.slope.cols(), samples = channel.residual.size();
    if (information.size() == 0) information = MatrixXd::Zero(parameters, parameters);
    const auto counted = static_cast<double>((channel.residual.array() != 0).count());
    if (counted == 0) continue;
    VectorXd power = smoothed_power(fourier(channel.residual), counted, half);
    power = power.cwiseMax(autoregressive_power(channel.residual, counted, power.size()));
    std::vector<Index> active;
    std::vector<VectorXcd> lines;
    for (Index j = 0; j < parameters; ++j) {
      if (channel.slope.col(j).squaredNorm() == 0) continue;
      active.push_back(j);
      lines.push_back(fourier(channel.slope.col(j)));
    }
    for (std::size_t a = 0; a < active.size(); ++a)
      for (std::size_t b = 0; b <= a; ++b) {
        const VectorXd cross = (lines[a].conjugate().cwiseProduct(lines[b])).real().cwiseProduct(power);
        double both_sides = 2 * cross.sum() - cross[0];
        if (samples % 2 == 0) both_sides -= cross[cross.size() - 1];
        information(active[a], active[b]) += both_sides / static_cast<double>(samples);
        if (a != b) information(active[b], active[a]) = information(active[a], active[b]);
      }
  }
  return information;
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
