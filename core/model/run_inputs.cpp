#include "core/model/run_inputs.h"

#include <algorithm>
#include <cmath>

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
  const Index n = run.samples();
  MatrixXd input(n + 1, (conditions.force ? 1 : 0) + (conditions.mount ? 2 : 0));
  Index column = 0;
  if (conditions.force) {
    input.col(column).head(n) = filled(run.channel("force").value);
    ++column;
  }
  if (conditions.mount) input.middleCols(column, 2).topRows(n) = mount_inputs(run);
  if (input.cols() > 0) input.row(n) = input.row(n - 1);
  return input;
}

}  // namespace unrig
