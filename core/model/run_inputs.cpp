#include "core/model/run_inputs.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/numerics/spectrum.h"
#include "core/numerics/spline_curvature.h"

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Missing samples on the straight line between their neighbours; at the ends, the nearest value.
VectorXd filled(VectorXd x) {
  Index before = -1;
  for (Index k = 0; k <= x.size(); ++k) {
    const bool there = k < x.size() && std::isfinite(x[k]);
    if (k < x.size() && !there) continue;
    const double left = before >= 0 ? x[before] : there ? x[k] : 0, right = there ? x[k] : left;
    for (Index i = before + 1; i < k; ++i) x[i] = left + (right - left) * static_cast<double>(i - before) / static_cast<double>(k - before);
    before = k;
  }
  return x;
}

/// Whether the samples tell what lies between them: as much power as straight lines lose is more than there would be if all frequencies had what the last eighth of them has.
bool is_resolved(const VectorXd& x) {
  const VectorXd power = fourier(window_weights(Window::hann, x.size()).cwiseProduct((x.array() - x.mean()).matrix())).cwiseAbs2();
  const Index lines = power.size(), last = lines / 8;
  if (last == 0) return false;
  const Eigen::ArrayXd phase = Eigen::ArrayXd::LinSpaced(lines, 0, std::numbers::pi);  // per sample
  return power.tail(last).mean() * static_cast<double>(lines) < ((phase.square() / 12).square() * power.array()).sum();
}

MatrixXd mount_inputs(const Run& run) {
  const Channel* velocity = run.find("mount_velocity");
  const Channel* acceleration = run.find("mount_acceleration");
  const Index n = run.samples();
  MatrixXd input(n, 2);
  if (velocity) {
    input.col(0) = filled(velocity->value);
  } else {
    const VectorXd a = filled(acceleration->value);
    const double mean = a.mean();
    input(0, 0) = 0;
    for (Index k = 1; k < n; ++k) input(k, 0) = input(k - 1, 0) + 0.5 * run.dt * (a[k] + a[k - 1] - 2 * mean);
  }
  if (acceleration) {
    input.col(1) = filled(acceleration->value);
  } else {
    const auto v = input.col(0);
    for (Index k = 0; k < n; ++k) {
      const Index before = std::max<Index>(0, k - 1), after = std::min(n - 1, k + 1);
      input(k, 1) = (v[after] - v[before]) / (run.dt * static_cast<double>(after - before));
    }
  }
  return input;
}

}  // namespace

MatrixXd run_inputs(const Run& run, const Conditions& conditions) {
  const Index n = run.samples(), force = conditions.force ? 1 : 0, count = force + (conditions.mount ? 2 : 0);
  MatrixXd input = MatrixXd::Zero(n + 1, 2 * count);
  if (const Channel* measured = run.find("force"); measured && conditions.force) input.col(0).head(n) = filled(measured->value);
  if (conditions.mount) input.middleCols(force, 2).topRows(n) = mount_inputs(run);
  for (Index i = 0; i < count; ++i)
    if (is_resolved(input.col(i).head(n))) input.col(count + i).head(n) = spline_curvature(input.col(i).head(n), run.dt);
  if (count > 0) input.row(n) = input.row(n - 1);
  return input;
}

}  // namespace unrig
