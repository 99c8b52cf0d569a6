#include "fit/search/first_guess.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "core/numerics/median.h"
#include "core/numerics/spectrum.h"

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

struct Line {
  double frequency = 0;  ///< Hz; 0: none
  double over_noise = 0; ///< its power over the median
};

Line strongest_line(VectorXd x, double dt) {
  x.array() -= x.mean();
  const Spectrum spectrum = amplitude_spectrum(x, dt, Window::hann, 4 * x.size());
  constexpr Index leakage = 6;  // lines of the padded spectrum that a slow drift can reach
  const VectorXd power = spectrum.line.tail(std::max<Index>(1, spectrum.line.size() - leakage)).cwiseAbs2();
  Index line = 0;
  const double most = power.maxCoeff(&line);
  return {spectrum.frequency(line + leakage), most / std::max(1e-300, median({power.begin(), power.end()}))};
}

/// Frequency [Hz] of the strongest line of a decay, 0 where there is none. A record that goes on for long after the decay has died out would hide it under its noise,
/// and under the window: of the whole, its first half, quarter, ... the part in which a line stands out most.
double strongest_line(const Run& run) {
  constexpr Index shortest = 2048;
  const Channel* gauge = run.find("gauge");
  if (!gauge) return 0;
  const VectorXd x = gauge->value.unaryExpr([](double v) { return std::isfinite(v) ? v : 0.0; });
  Line best = strongest_line(x, run.dt);
  for (Index samples = x.size() / 2; samples >= shortest; samples /= 2)
    if (const Line line = strongest_line(x.head(samples), run.dt); line.over_noise > best.over_noise) best = line;
  return best.frequency;
}

}  // namespace

void guess_from_spectra(JointProblem& joint) {
  const AeroelasticModel& model = joint.model();
  const Rig& rig = model.rig();
  if (rig.is_modal() ? rig.modal.size() != 1 : rig.gauge_element == 0) return;
  std::vector<double> scales;
  for (const RunResidual& run : joint.runs()) {
    if (run.run().kind != RunKind::pluck) continue;
    const double modelled = rig.is_modal() ? rig.modal.front().frequency : coupled_frequencies(rig, model.basis(), run.run().density)[0];
    const double measured = strongest_line(run.run());
    if (measured > 0) scales.push_back(measured * measured / (modelled * modelled));
  }
  if (scales.empty()) return;
  const double scale = median(scales);
  for (Unknown& u : joint.unknowns()) {
    const Parameter& p = joint.parameter(u);
    const bool stiffness = p.name.ends_with("stiffness_scale") || p.name.ends_with(".stiffness");
    if (stiffness && !u.held && u.value == p.start) u.value = std::clamp(scale * p.start, p.lower, p.upper);
  }
}

}  // namespace unrig
