#include "core/numerics/spectrum.h"

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

/// As FFTW wants its memory.
struct Buffers {
  explicit Buffers(Index length) : real(fftw_alloc_real(static_cast<std::size_t>(length))), lines(fftw_alloc_complex(static_cast<std::size_t>(length / 2 + 1))) {
    if (!real || !lines) throw std::bad_alloc();
  }
  std::unique_ptr<double, FftwFree<double>> real;
  std::unique_ptr<fftw_complex, FftwFree<fftw_complex>> lines;
};

}  // namespace

struct FourierPlan::Plans {
  fftw_plan forward = nullptr, inverse = nullptr;
};

FourierPlan::FourierPlan(Index length) : length_(length), plans_(std::make_unique<Plans>()) {
  if (length < 1) throw std::invalid_argument("a transform needs at least one sample");
  const Buffers buffers(length);
  const std::lock_guard lock(planner());
  plans_->forward = fftw_plan_dft_r2c_1d(static_cast<int>(length), buffers.real.get(), buffers.lines.get(), FFTW_ESTIMATE);
  plans_->inverse = fftw_plan_dft_c2r_1d(static_cast<int>(length), buffers.lines.get(), buffers.real.get(), FFTW_ESTIMATE);
  if (plans_->forward == nullptr || plans_->inverse == nullptr) throw std::runtime_error(fmt::format("FFTW has no plan for {} samples", length));
}

FourierPlan::~FourierPlan() {
  const std::lock_guard lock(planner());
  fftw_destroy_plan(plans_->forward);
  fftw_destroy_plan(plans_->inverse);
}

VectorXcd FourierPlan::forward(const VectorXd& x) const {
  if (x.size() == 0) throw std::invalid_argument("a transform needs at least one sample");
  if (length_ < x.size()) throw std::invalid_argument(fmt::format("a transform of {} samples was asked for, of a record of {}", length_, x.size()));
  if (!x.allFinite()) throw std::invalid_argument("a transform needs finite samples");
  const Buffers buffers(length_);
  std::copy_n(x.data(), x.size(), buffers.real.get());
  std::fill(buffers.real.get() + x.size(), buffers.real.get() + length_, 0.0);
  fftw_execute_dft_r2c(plans_->forward, buffers.real.get(), buffers.lines.get());
  VectorXcd result(length_ / 2 + 1);
  for (Index k = 0; k < result.size(); ++k) result[k] = {buffers.lines.get()[k][0], buffers.lines.get()[k][1]};
  return result;
}

VectorXd FourierPlan::inverse(const VectorXcd& lines) const {
  if (lines.size() != length_ / 2 + 1) throw std::invalid_argument(fmt::format("a record of {} samples has {} lines, not {}", length_, length_ / 2 + 1, lines.size()));
  const Buffers buffers(length_);
  for (Index k = 0; k < lines.size(); ++k) buffers.lines.get()[k][0] = lines[k].real(), buffers.lines.get()[k][1] = lines[k].imag();
  fftw_execute_dft_c2r(plans_->inverse, buffers.lines.get(), buffers.real.get());
  return Eigen::Map<const VectorXd>(buffers.real.get(), length_) / static_cast<double>(length_);
}

void FourierPlan::forward(const VectorXd& x, VectorXcd& lines) const {
  if (x.size() != length_) throw std::invalid_argument(fmt::format("a transform of {} samples was asked for, of {} in place", length_, x.size()));
  lines.resize(length_ / 2 + 1);
  fftw_execute_dft_r2c(plans_->forward, const_cast<double*>(x.data()), reinterpret_cast<fftw_complex*>(lines.data()));  // which leaves its input as it is
}

void FourierPlan::inverse(VectorXcd& lines, VectorXd& x) const {
  if (lines.size() != length_ / 2 + 1) throw std::invalid_argument(fmt::format("a record of {} samples has {} lines, not {}", length_, length_ / 2 + 1, lines.size()));
  x.resize(length_);
  fftw_execute_dft_c2r(plans_->inverse, reinterpret_cast<fftw_complex*>(lines.data()), x.data());
}

VectorXcd fourier(const VectorXd& x, Index length) { return FourierPlan(length == 0 ? x.size() : length).forward(x); }

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
