#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include <fmt/format.h>

#include "correct/report/result_files.h"
#include "fit/uncertainty/profile.h"

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

/// r_j = sum x_k x_{k+j} / sum x_k^2 over the pairs that are both there, each sum over its count; of 1/sqrt(n) standard deviation for white noise (Box and Jenkins, Time Series Analysis, section 2.1.6).
void add_autocorrelation(ReportPage& page, const std::string& name, VectorXd x, double dt) {
  constexpr Index most_lags = 400;
  const Eigen::Array<bool, Eigen::Dynamic, 1> there = x.array().isFinite();
  const double count = static_cast<double>(there.count());
  const double mean = there.select(x.array(), 0).sum() / count;
  x = there.select(x.array() - mean, 0).matrix();
  const VectorXd in = there.cast<double>().matrix();
  const Index lags = std::min<Index>(most_lags, x.size() / 4);
  const double variance = x.squaredNorm() / count;
  if (lags < 2 || !(variance > 0)) return;
  VectorXd r(lags), error(lags);
  for (Index j = 1; j <= lags; ++j) {
    const double pairs = in.head(in.size() - j).dot(in.tail(in.size() - j));
    r[j - 1] = pairs > 0 ? x.head(x.size() - j).dot(x.tail(x.size() - j)) / pairs / variance : std::nan("");
    error[j - 1] = 1 / std::sqrt(std::max(1.0, pairs));
  }
  page.add_plot({name + ": autocorrelation of the residual", "lag [s]", "autocorrelation", VectorXd::LinSpaced(lags, dt, dt * static_cast<double>(lags)),
                 {{"residual", 1, r}, {"white noise", 0, VectorXd::Zero(lags), error, true}}, "", "95 % of the points of white noise lie in the band. A slow decay is noise of a colour, a swing something that vibrates.", false, false, 180});
}

/// Sorted residuals over their noise against the normal quantiles of (k - 1/2)/n; the k-th of n has the standard deviation sqrt(p (1 - p) / n) / density (David and Nagaraja, Order Statistics, section 10.2).
void add_quantiles(ReportPage& page, const std::string& name, const VectorXd& residual, double sigma) {
  constexpr std::size_t most_points = 300;
  std::vector<double> sorted;
  for (const double x : residual)
    if (std::isfinite(x)) sorted.push_back(x / sigma);
  if (sorted.size() < 8 || !(sigma > 0)) return;
  std::sort(sorted.begin(), sorted.end());
  const std::size_t points = std::min(most_points, sorted.size());
  const double n = static_cast<double>(sorted.size());
  std::vector<double> at, value, error;
  std::size_t last = sorted.size();
  for (std::size_t k = 0; k < points; ++k) {
    // Close together in the tails, where it matters: even in the angle of a cosine.
    const double share = 0.5 - 0.5 * std::cos(std::numbers::pi * static_cast<double>(k) / static_cast<double>(points - 1));
    const std::size_t i = static_cast<std::size_t>(std::llround(share * (n - 1)));
    if (i == last) continue;
    last = i;
    const double p = (static_cast<double>(i) + 0.5) / n, z = std::copysign(two_sided_quantile(std::abs(2 * p - 1)), p - 0.5);
    const double density = std::exp(-z * z / 2) / std::sqrt(2 * std::numbers::pi);
    at.push_back(z);
    value.push_back(sorted[i]);
    error.push_back(std::sqrt(p * (1 - p) / n) / density);
  }
  const auto vector = [](const std::vector<double>& x) { return VectorXd(Eigen::Map<const VectorXd>(x.data(), static_cast<Index>(x.size()))); };
  page.add_plot({name + ": quantiles of the residual", "quantile of the normal distribution [standard deviations]", "residual over its noise", vector(at),
                 {{"residual", 1, vector(value), {}, false, true}, {"normal distribution", 0, vector(at), vector(error), true}}, "",
                 "Points that leave the line at both ends are outliers; another slope is noise of another size than the fit takes it for.", false, false, 220});
}

}  // namespace

void add_residual_checks(ReportPage& page, const std::string& name, const VectorXd& residual, double sigma, double dt) {
  if (residual.size() < 16 || !residual.array().isFinite().any()) return;
  add_autocorrelation(page, name, residual, dt);
  add_quantiles(page, name, residual, sigma);
}

}  // namespace unrig
