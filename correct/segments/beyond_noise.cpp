#include "correct/segments/beyond_noise.h"

#include <algorithm>
#include <cmath>

#include "core/files/text_file.h"
#include "correct/estimate/misfit.h"
#include "correct/segments/load_in_legs.h"
#include "fit/likelihood/explained.h"
#include "fit/uncertainty/coloured_noise.h"

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Whether what the fit left of one run may be in another one's readings too: of a run without a stream always, of one with a stream where something remains of the other run as well. Else a load that builds
/// up in another way than the fit's would count, which is what is estimated.
bool tells_of_others(const LeftByFit& left, bool remains) { return !left.in_stream || remains; }

/// Density of what the fit left of such runs: the mean of those without a stream, or of those with one, whichever is larger at this frequency.
double left_by_fit(const std::vector<LeftByFit>& left, bool remains, const std::string& channel, double frequency) {
  double sum[2] = {0, 0}, count[2] = {0, 0};
  for (const LeftByFit& one : left) {
    if (one.channel != channel || !tells_of_others(one, remains)) continue;
    sum[one.in_stream] += one.power.at(frequency);
    ++count[one.in_stream];
  }
  return std::max(sum[0] / std::max(1.0, count[0]), sum[1] / std::max(1.0, count[1]));
}

/// Whether what is left of a run at rest is not white, at the level of the fit's standard errors.
bool is_coloured(const RunResidual& residual, const RunResidual::Sensitivity& sensitivity) {
  constexpr double significant = 0.01;
  std::vector<VectorXd> at_rest;
  for (const auto& channel : sensitivity.channels) at_rest.push_back(residual_at_rest(channel.residual, residual.motion().phases(), residual.linear_unknowns()));
  return whiteness(at_rest) < significant;
}

bool is_fitted(const RunResidual& residual, const std::string& channel) {
  return std::find(residual.channels().begin(), residual.channels().end(), channel) != residual.channels().end();
}

}  // namespace

BeyondNoise moved_beyond_noise(const RunResidual& residual, const RunResidual::Evaluation& e, const Prior& prior, const VectorXd& theta, double reduced_chi2, const FittedRig& fit, const std::vector<Index>& at) {
  const bool explained = reduced_chi2 <= most_of_noise(residual.degrees_of_freedom());
  BeyondNoise beyond;
  if (!std::isfinite(reduced_chi2) || (explained && fit.left.empty())) return beyond;
  const RunResidual::Sensitivity sensitivity = residual.sensitivity(theta);
  const MatrixXd root = theta_root(e, prior);
  const bool remains = !explained || is_coloured(residual, sensitivity);
  for (const LeftByFit& one : fit.left)
    if (is_fitted(residual, one.channel) && tells_of_others(one, remains)) beyond.unexplained.insert(base_name(one.run));
  if (!beyond.unexplained.empty()) beyond.of_fit = disturbance_root(residual, sensitivity, e, root, [&](const std::string& channel, double frequency) { return left_by_fit(fit.left, remains, channel, frequency); });
  if (explained) return beyond;
  const RigidLoad load = load_at(residual, theta, e.linear, at, {});
  MatrixXd by_theta = load.circulatory_by_theta + load.circulatory_by_motion * e.linear_slope.topRows(load.circulatory_by_motion.cols());
  by_theta.rowwise() += steady_per_reading(residual.model().rig()) * e.linear_slope.row(residual.first_offset());
  beyond.own = std::max(1.0, misfit_over_noise(sensitivity, root, by_theta, reduced_chi2));
  return beyond;
}

}  // namespace unrig
