#include "fit/diagnose/maps.h"

#include <algorithm>
#include <cmath>

#include "core/numerics/spectrum.h"
#include "fit/force/run_states.h"
#include "fit/likelihood/standardised_residual.h"

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Means of x over `groups` stretches of about equal length.
VectorXd grouped(const VectorXd& x, Index groups) {
  groups = std::min(groups, x.size());
  VectorXd mean(groups);
  for (Index g = 0; g < groups; ++g) {
    const Index first = g * x.size() / groups, last = (g + 1) * x.size() / groups;
    mean[g] = x.segment(first, last - first).mean();
  }
  return mean;
}

RestoringForceMap force_map(const RunResidual& run, const RunResidual::Prediction& p, const VectorXd& theta, const VectorXd& residual) {
  const Rig& rig = run.model().rig();
  const std::string unit = rig.is_modal() && !rig.modal.front().gauge_unit.empty() ? rig.modal.front().gauge_unit : "m";
  const std::vector<RunState> states = run_states(run, p, theta);
  const double gain = unit == "m" ? 1 : rig.modal.front().gauge_gain;
  RestoringForceMap map = restoring_force(states[0].value * gain, states[1].value * gain, residual);
  map.displacement_unit = unit;
  map.velocity_unit = unit + "/s";
  map.force_unit = run.run().channel(p.channels[0]).unit;
  return map;
}

}  // namespace

TimeFrequencyMap time_frequency(const VectorXd& x, double start, double dt, Index columns, Index most_bands) {
  constexpr double above_noise = 20;  // exceeded by chance by exp(-20) of the powers
  const Index length = std::min(x.size(), std::max<Index>(32, x.size() / 6)), step = std::max<Index>(1, (x.size() - length) / std::max<Index>(1, columns - 1));
  const Index windows = 1 + (x.size() - length) / step, lines = (length - 1) / 2;  // without line 0 and, of an even length, the last: noise of another kind
  TimeFrequencyMap map{VectorXd(windows), {}, {}, false};
  if (lines < 4) return map;
  MatrixXd power(lines, windows);
  double spacing = 0;
  for (Index w = 0; w < windows; ++w) {
    const Spectrum s = amplitude_spectrum(x.segment(w * step, length), dt);
    spacing = s.spacing;
    power.col(w) = s.line.segment(1, lines).cwiseAbs2() / s.noise_gain;
    map.time[w] = start + dt * (static_cast<double>(w * step) + 0.5 * static_cast<double>(length - 1));
  }
  Index highest = lines;  // nothing stands out above it
  while (highest > 1 && power.row(highest - 1).maxCoeff() < above_noise) --highest;
  const Index shown = highest <= 1 ? lines : std::min(lines, highest + highest / 4 + 8);
  map.noise_above = shown < lines;
  map.frequency = grouped(VectorXd::LinSpaced(shown, spacing, spacing * static_cast<double>(shown)), most_bands);
  map.power.resize(map.frequency.size(), windows);
  for (Index w = 0; w < windows; ++w) map.power.col(w) = grouped(power.col(w).head(shown), most_bands);
  return map;
}

RestoringForceMap restoring_force(const VectorXd& displacement, const VectorXd& velocity, const VectorXd& force, Index cells) {
  constexpr double fewest = 3, beyond = 0.005;  // a short jerk must not shrink everything else to one cell
  const auto middles = [&](VectorXd x) {
    const auto at = [&](double share) {
      const auto place = x.begin() + static_cast<Index>(share * static_cast<double>(x.size() - 1));
      std::nth_element(x.begin(), place, x.end());
      return *place;
    };
    const double low = at(beyond), width = (at(1 - beyond) - low) / static_cast<double>(cells);
    return VectorXd(VectorXd::LinSpaced(cells, low + width / 2, low + width * (static_cast<double>(cells) - 0.5)));
  };
  const auto cell = [cells](double x, const VectorXd& at) {
    const double width = (at[cells - 1] - at[0]) / static_cast<double>(cells - 1);
    return width > 0 ? static_cast<Index>(std::lround((x - at[0]) / width)) : Index{0};
  };
  const auto inside = [cells](Index c) { return c >= 0 && c < cells; };
  RestoringForceMap map{middles(displacement), middles(velocity), {}, {}, {}, {}};
  MatrixXd sum = MatrixXd::Zero(cells, cells), count = sum;
  for (Index k = 0; k < force.size(); ++k) {
    const Index i = cell(velocity[k], map.velocity), j = cell(displacement[k], map.displacement);
    if (!inside(i) || !inside(j)) continue;
    sum(i, j) += force[k];
    count(i, j) += 1;
  }
  map.force = (count.array() >= fewest).select(sum.array() / count.array(), std::nan(""));
  return map;
}

std::vector<ResidualMaps> residual_maps(const JointProblem& joint, const std::vector<std::string>& of_force) {
  std::vector<ResidualMaps> maps;
  for (std::size_t r = 0; r < joint.runs().size(); ++r) {
    const RunResidual& run = joint.runs()[r];
    const VectorXd theta = joint.theta(r);
    const RunResidual::Prediction p = run.predict(theta);
    const VectorXd left = standardised_residual(run, theta, p, 0);
    maps.push_back({run.run().file, p.channels[0], time_frequency(left, run.run().start, run.run().dt), {}});
    if (std::find(of_force.begin(), of_force.end(), run.run().file) != of_force.end()) maps.back().force = force_map(run, p, theta, left * run.sigma(0));
  }
  return maps;
}

}  // namespace unrig
