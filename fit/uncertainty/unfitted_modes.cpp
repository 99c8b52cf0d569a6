#include "fit/uncertainty/unfitted_modes.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <numbers>
#include <optional>

#include <fmt/format.h>

#include "core/numerics/spectrum.h"
#include "fit/likelihood/standardised_residual.h"

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

constexpr double clearly = 20;
constexpr double near_a_mode = 1.25, half = 0.5;

VectorXd power_of(const VectorXd& x, const VectorXd& weight) {
  VectorXd there = x;
  double sum = 0, count = 0;
  for (Index k = 0; k < x.size(); ++k)
    if (weight[k] > 0 && std::isfinite(x[k])) sum += x[k], ++count;
  for (Index k = 0; k < x.size(); ++k) there[k] = weight[k] > 0 && std::isfinite(x[k]) ? x[k] - sum / std::max(1.0, count) : 0;
  return fourier(there).cwiseAbs2();
}

VectorXd floor_of(const VectorXd& power) { return noise_floor(power, std::max<Index>(16, power.size() / 32)); }

std::optional<std::size_t> nearest_mode(const std::vector<ModalMode>& modes, double frequency) {
  const auto distance = [&](const ModalMode& m) { return std::abs(std::log(m.frequency / frequency)); };
  const auto nearest = std::min_element(modes.begin(), modes.end(), [&](const ModalMode& a, const ModalMode& b) { return distance(a) < distance(b); });
  if (distance(*nearest) > std::log(near_a_mode)) return std::nullopt;
  return static_cast<std::size_t>(nearest - modes.begin());
}

/// The most of a spectrum in a line and its neighbours.
double around(const VectorXd& power, Index line) { return power.segment(line - 1, 3).maxCoeff(); }

/// Of one channel: marks modes with a line that is followed, and keeps for the others the strongest that is not.
void look_at_channel(const RunResidual& run, const VectorXd& theta, const RunResidual::Prediction& p, std::size_t c, std::vector<bool>& followed, std::vector<UnfittedMode>& left_over) {
  const VectorXd& reading = run.run().channel(p.channels[c]).value;
  const VectorXd weight = run.channel_weight(c), standardised = standardised_residual(run, theta, p, c);
  const VectorXd read = power_of(reading, weight), left = power_of(reading - p.output.col(static_cast<Index>(c)), weight), white = power_of(standardised, weight), floor = floor_of(white);
  const double spacing = 1 / (run.run().dt * static_cast<double>(reading.size()));
  for (const Peak& peak : peaks_above(read, floor_of(read), clearly)) {
    const double frequency = peak.position * spacing;
    const std::optional<std::size_t> mode = nearest_mode(run.model().rig().modal, frequency);
    if (!mode) continue;
    if (around(left, peak.line) < half * around(read, peak.line)) {
      followed[*mode] = true;
      continue;
    }
    UnfittedMode& worst = left_over[*mode];
    const double over_floor = around(white, peak.line) / std::max(1e-300, floor[peak.line]);
    if (over_floor > std::max(clearly, worst.over_floor)) worst = {*mode, run.run().file, p.channels[c], frequency, over_floor};
  }
}

}  // namespace

std::vector<UnfittedMode> unfitted_modes(const JointProblem& joint) {
  const std::size_t count = joint.model().rig().modal.size();
  std::vector<bool> followed(count, false);
  std::vector<UnfittedMode> left_over(count), found;
  for (std::size_t r = 0; r < joint.runs().size() && count > 0; ++r) {
    const RunResidual& run = joint.runs()[r];
    const RunResidual::Prediction p = run.predict(joint.theta(r));
    if (run.is_aside() || !p.output.allFinite()) continue;
    for (std::size_t c = 0; c < p.channels.size(); ++c) look_at_channel(run, joint.theta(r), p, c, followed, left_over);
  }
  for (std::size_t i = 0; i < count; ++i)
    if (!followed[i] && left_over[i].over_floor > 0) found.push_back(left_over[i]);
  return found;
}

void refuse_unfitted_modes(const JointProblem& joint, FitResult& result) {
  if (!result.no_answer.empty()) return;
  const std::vector<UnfittedMode> modes = unfitted_modes(joint);
  if (modes.empty()) return;
  const UnfittedMode& m = modes.front();
  const ModalMode& file = joint.model().rig().modal[m.mode];
  const double omega = 2 * std::numbers::pi * m.frequency;
  result.no_answer = fmt::format("{}: the column \"{}\" keeps a line at {:.4g} Hz, {:.3g} times what is left around it, which belongs to modal[{}] of the rig file ({:.4g} Hz): the fit does not follow this mode. Correct "
                                 "its frequency in the rig file, or give --start modal[{}].stiffness={:.4g}.",
                                 std::filesystem::path(m.run).filename().string(), m.channel, m.frequency, m.over_floor, m.mode + 1, file.frequency, m.mode + 1, file.mass * omega * omega);
  for (FittedParameter& p : result.parameters) {
    if (p.identified) p.advice = fmt::format("The fit does not follow modal[{}]. ", m.mode + 1) + p.advice;
    p.identified = false;
  }
}

}  // namespace unrig
