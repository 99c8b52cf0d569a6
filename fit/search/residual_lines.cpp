#include "fit/search/residual_lines.h"

#include <algorithm>
#include <utility>

#include "core/numerics/spectrum.h"

namespace unrig {

using Eigen::Index;
using Eigen::VectorXd;

ResidualLines::ResidualLines(const JointProblem& joint) {
  for (std::size_t r = 0; r < joint.runs().size(); ++r) {
    const RunResidual& run = joint.runs()[r];
    const RunResidual::Prediction p = run.predict(joint.theta(r));
    VectorXd left = run.run().channel(p.channels.front()).value - p.output.col(0);
    for (Index k = 0; k < left.size(); ++k)
      if (!(run.channel_weight(0)[k] > 0) || !std::isfinite(left[k])) left[k] = 0;
    left /= std::max(1e-300, std::sqrt(left.squaredNorm() / static_cast<double>(left.size())));
    power_.push_back(fourier(left, padding * left.size()).cwiseAbs2() / static_cast<double>(left.size()));
    duration_.push_back(run.run().dt * static_cast<double>(left.size()));
  }
}

std::vector<VectorXd> tone_starts(const ResidualLines& lines, const JointProblem& joint, const Effect& e) {
  const Rig& rig = joint.model().rig();
  const std::vector<Parameter>& parameters = e.parameters_on(rig);
  VectorXd p(static_cast<Index>(parameters.size()));
  for (Index k = 0; k < p.size(); ++k) p[k] = parameters[static_cast<std::size_t>(k)].start;
  std::vector<Effect::Band> bands = e.bands;
  if (bands.empty()) bands.emplace_back(parameters[0].lower, parameters[0].upper);
  std::vector<std::pair<double, double>> found;  // power, parameter
  for (const auto& [lower, upper] : bands) {
    bool is_in_a_run = true;
    for (p[0] = lower; p[0] < upper && is_in_a_run;) {
      double power = 0, finest = upper - lower;
      is_in_a_run = false;
      for (std::size_t r = 0; r < joint.runs().size(); ++r) {
        const Conditions& c = joint.runs()[r].conditions();
        if (!e.acts(rig, c)) continue;
        const double f = e.frequency(joint.model(), c, p);
        power += lines.power(r, f);
        is_in_a_run = is_in_a_run || lines.is_in(r, f);
        finest = std::min(finest, 0.3 * lines.resolution(r) * p[0] / f);
      }
      found.emplace_back(power, p[0]);
      p[0] += finest;
    }
  }
  std::sort(found.rbegin(), found.rend());
  std::vector<VectorXd> starts;
  constexpr std::size_t most = 3;
  std::vector<double> values;
  for (const auto& [power, value] : found) {
    if (std::none_of(values.begin(), values.end(), [value = value](double other) { return std::abs(other - value) < 0.05 * value; })) values.push_back(value);
    if (values.size() == most) break;
  }
  const bool has_starts = !e.starts.empty() && e.starts.front().size() == p.size();  // those of a beam are not those of modes
  for (const double value : values)
    for (VectorXd start : has_starts ? e.starts : std::vector<VectorXd>{p}) {
      start[0] = value;
      starts.push_back(std::move(start));
    }
  return starts;
}

}  // namespace unrig
