#pragma once
#include <Eigen/Core>
#include <memory>
#include <vector>

namespace unrig {

/// Discrete Fourier transform of a real record, of any length n (FFTW, real to complex), not scaled:
///
///   F_k = sum_j x_j exp(-2 pi i j k / n),  k = 0 .. floor(n / 2)
///
/// The other half is the complex conjugate. `length` > x.size() pads with zeros; 0 stands for x.size().
/// Throws std::invalid_argument for an empty record, a sample that is not finite, or a `length` shorter than the record.
/// Safe to call from several threads at once. Source: M. Frigo and S. G. Johnson, Proc. IEEE 93 (2005) 216.
Eigen::VectorXcd fourier(const Eigen::VectorXd& x, Eigen::Index length = 0);

/// The same for many records: what FFTW prepares for a length is kept.
class FourierPlan {
 public:
  explicit FourierPlan(Eigen::Index length);
  ~FourierPlan();
  FourierPlan(const FourierPlan&) = delete;
  FourierPlan& operator=(const FourierPlan&) = delete;

  Eigen::VectorXcd forward(const Eigen::VectorXd& x) const;  ///< with zeros behind x
  /// The record of `length` samples that has the lines 0 .. floor(length / 2), scaled so that it undoes `forward`. Throws std::invalid_argument where their number does not fit.
  Eigen::VectorXd inverse(const Eigen::VectorXcd& lines) const;
  /// Both without a copy: `x` has `length` samples, `lines` becomes as long as it must; the inverse is not scaled and leaves nothing of the lines.
  void forward(const Eigen::VectorXd& x, Eigen::VectorXcd& lines) const;
  void inverse(Eigen::VectorXcd& lines, Eigen::VectorXd& x) const;
  Eigen::Index length() const { return length_; }

 private:
  Eigen::Index length_;
  struct Plans;
  std::unique_ptr<Plans> plans_;
};

/// Weights on the samples before the transform (F. J. Harris, Proc. IEEE 66 (1978) 51).
enum class Window {
  rectangular,  ///< 1: narrowest line, side lobes falling by 6 dB per octave
  hann          ///< (1 - cos(2 pi j / n)) / 2, periodic: line twice as wide, side lobes falling by 18 dB per octave
};
Eigen::VectorXd window_weights(Window window, Eigen::Index samples);

/// One-sided amplitude spectrum. A tone A cos(2 pi f t + phase) on a line reads `line` = A exp(i phase) there, a constant c reads c in line 0.
///
///   line_k = g_k / (sum of weights) * F_k(weight * x),  g_k = 2, but 1 for line 0 and, where the (padded) length is even, the last
///
/// Parseval, without window and padding: mean of x^2 = |line_0|^2 + sum |line_k|^2 / 2, the last line counting whole for an even length.
struct Spectrum {
  double spacing = 0;  ///< Hz between lines: 1 / (length dt)
  double noise_gain = 0;  ///< white noise of standard deviation s has E |line_k|^2 = noise_gain s^2 (inner lines)
  Eigen::VectorXcd line;  ///< in the unit of the record

  double frequency(Eigen::Index k) const { return spacing * static_cast<double>(k); }  ///< Hz
};

/// Spectrum of samples `dt` [s] apart. Throws std::invalid_argument as `fourier` does, and for a `dt` that is not positive.
Spectrum amplitude_spectrum(const Eigen::VectorXd& x, double dt, Window window = Window::hann, Eigen::Index length = 0);

/// Power of the noise under the lines: the running median of `power` over `half_width` lines on either side (fewer at the ends), over ln 2, which is
/// the median of the power of a Gaussian line over its mean. Lines that stand alone do not count.
/// Throws std::invalid_argument for a negative half width.
Eigen::VectorXd noise_floor(const Eigen::VectorXd& power, Eigen::Index half_width);

/// A line that stands out: a local maximum of the power.
struct Peak {
  Eigen::Index line = 0;
  double position = 0;  ///< in lines, from the parabola through the logarithms of three powers (good to about 0.05 lines under a Hann window)
  double power = 0;     ///< of the line
};

/// The local maxima of `power` above `factor` times `floor`, strongest first. A noise line exceeds it with probability exp(-factor).
/// Line 0 and the last are never peaks: they have a neighbour on one side only.
std::vector<Peak> peaks_above(const Eigen::VectorXd& power, const Eigen::VectorXd& floor, double factor);

}  // namespace unrig
