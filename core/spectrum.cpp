#include "core/spectrum.h"

#include <fftw3.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <mutex>
#include <numbers>
#include <stdexcept>

#include <fmt/format.h>

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::VectorXcd;
using Eigen::VectorXd;

std::mutex& planner() {  // FFTW: only `execute` may run in several threads at once
  static std::mutex mutex;
  return mutex;
}

template <class T>
struct FftwFree {
  void operator()(T* memory) const { fftw_free(memory); }
};

/// Arrays and plan of one transform of a given length.
class RealTransform {
 public:
  explicit RealTransform(Index length)
      : in_(fftw_alloc_real(static_cast<std::size_t>(length))), out_(fftw_alloc_complex(static_cast<std::size_t>(length / 2 + 1))) {
    if (!in_ || !out_) throw std::bad_alloc();
    const std::lock_guard lock(planner());
    plan_ = fftw_plan_dft_r2c_1d(static_cast<int>(length), in_.get(), out_.get(), FFTW_ESTIMATE);
    if (plan_ == nullptr) throw std::runtime_error(fmt::format("FFTW has no plan for {} samples", length));
  }
  ~RealTransform() {
    const std::lock_guard lock(planner());
    fftw_destroy_plan(plan_);
  }
  RealTransform(const RealTransform&) = delete;
  RealTransform& operator=(const RealTransform&) = delete;

  double* input() { return in_.get(); }
  const fftw_complex* execute() {
    fftw_execute(plan_);
    return out_.get();
  }

 private:
  std::unique_ptr<double, FftwFree<double>> in_;
  std::unique_ptr<fftw_complex, FftwFree<fftw_complex>> out_;
  fftw_plan plan_ = nullptr;
};

}  // namespace

VectorXcd fourier(const VectorXd& x, Index length) {
  if (length == 0) length = x.size();
  if (x.size() == 0) throw std::invalid_argument("a transform needs at least one sample");
  if (length < x.size()) throw std::invalid_argument(fmt::format("a transform of {} samples was asked for, of a record of {}", length, x.size()));
  if (!x.allFinite()) throw std::invalid_argument("a transform needs finite samples");
  RealTransform transform(length);
  std::copy_n(x.data(), x.size(), transform.input());
  std::fill(transform.input() + x.size(), transform.input() + length, 0.0);
  const fftw_complex* lines = transform.execute();
  VectorXcd result(length / 2 + 1);
  for (Index k = 0; k < result.size(); ++k) result[k] = {lines[k][0], lines[k][1]};
  return result;
}

VectorXd window_weights(Window window, Index samples) {
  if (window == Window::rectangular) return VectorXd::Ones(samples);
  const double step = 2 * std::numbers::pi / static_cast<double>(samples);
  return VectorXd::NullaryExpr(samples, [&](Index j) { return (1 - std::cos(step * static_cast<double>(j))) / 2; });
}

Spectrum amplitude_spectrum(const VectorXd& x, double dt, Window window, Index length) {
  if (!(dt > 0)) throw std::invalid_argument(fmt::format("a spectrum needs a positive sampling interval, not {} s", dt));
  if (length == 0) length = x.size();
  const VectorXd weight = window_weights(window, x.size());
  Spectrum s;
  s.line = (2 / weight.sum()) * fourier(weight.cwiseProduct(x), length);
  s.line[0] /= 2;
  if (length % 2 == 0 && length > 1) s.line[length / 2] /= 2;
  s.spacing = 1 / (static_cast<double>(length) * dt);
  s.noise_gain = 4 * weight.squaredNorm() / (weight.sum() * weight.sum());
  return s;
}

VectorXd noise_floor(const VectorXd& power, Index half_width) {
  if (half_width < 0) throw std::invalid_argument("a noise floor needs a half width of at least 0 lines");
  VectorXd floor(power.size());
  std::vector<double> sorted;  // the lines inside the window
  const auto insert = [&](Index k) { sorted.insert(std::upper_bound(sorted.begin(), sorted.end(), power[k]), power[k]); };
  for (Index k = 0; k < std::min(half_width, power.size()); ++k) insert(k);
  for (Index k = 0; k < power.size(); ++k) {
    if (k + half_width < power.size()) insert(k + half_width);
    if (k > half_width) sorted.erase(std::lower_bound(sorted.begin(), sorted.end(), power[k - half_width - 1]));
    const std::size_t middle = sorted.size() / 2;
    const double median = sorted.size() % 2 == 1 ? sorted[middle] : (sorted[middle - 1] + sorted[middle]) / 2;
    floor[k] = median / std::numbers::ln2;
  }
  return floor;
}

std::vector<Peak> peaks_above(const VectorXd& power, const VectorXd& floor, double factor) {
  if (power.size() != floor.size()) throw std::invalid_argument("power and floor must have the same lines");
  std::vector<Peak> peaks;
  for (Index k = 1; k + 1 < power.size(); ++k) {
    if (!(power[k] > factor * floor[k] && power[k] >= power[k - 1] && power[k] > power[k + 1])) continue;
    Peak peak{k, static_cast<double>(k), power[k]};
    const double before = std::log(power[k - 1]), here = std::log(power[k]), after = std::log(power[k + 1]);
    const double curvature = before - 2 * here + after;  // minus infinity beside a line of zero
    if (std::isfinite(curvature) && curvature < 0) peak.position += 0.5 * (before - after) / curvature;
    peaks.push_back(peak);
  }
  std::sort(peaks.begin(), peaks.end(), [](const Peak& a, const Peak& b) { return a.power > b.power; });
  return peaks;
}

}  // namespace unrig
