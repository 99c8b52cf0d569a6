#pragma once
#include <Eigen/Core>
#include <cmath>
#include <numbers>

#include "core/run/run.h"

namespace unrig::test {

/// Samples [first, last) as a run of their own.
inline Run part(const Run& whole, Eigen::Index first, Eigen::Index last) {
  Run run = whole;
  run.start = whole.time(first);
  for (Channel& c : run.channels) c.value = Eigen::VectorXd(c.value.segment(first, last - first));
  return run;
}

/// Butterworth's low-pass of second order, forward and backward: no phase. Source: bilinear transform, A. V. Oppenheim and R. W. Schafer, 7.1.
inline Eigen::VectorXd below(double cutoff, const Eigen::VectorXd& x, double dt) {
  const double k = std::tan(std::numbers::pi * cutoff * dt), norm = 1 / (1 + std::sqrt(2.0) * k + k * k);
  const auto filter = [&](const Eigen::VectorXd& in) {
    Eigen::VectorXd out(in.size());
    double x1 = in[0], x2 = in[0], y1 = in[0], y2 = in[0];
    for (Eigen::Index i = 0; i < in.size(); ++i) {
      out[i] = norm * (k * k * (in[i] + 2 * x1 + x2) - 2 * (k * k - 1) * y1 - (1 - std::sqrt(2.0) * k + k * k) * y2);
      x2 = x1, x1 = in[i], y2 = y1, y1 = out[i];
    }
    return out;
  };
  const Eigen::VectorXd forward = filter(x);
  return filter(forward.reverse()).reverse();
}

inline double rms(const Eigen::VectorXd& x) { return std::sqrt(x.squaredNorm() / static_cast<double>(x.size())); }

}  // namespace unrig::test
