#include "fit/first_guess.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "core/spectrum.h"

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

/// Frequency [Hz] of the strongest line of a decay, 0 where there is none.
double strongest_line(const Run& run) {
  const Channel* gauge = run.find("gauge");
  if (!gauge) return 0;
  VectorXd x = gauge->value.unaryExpr([](double v) { return std::isfinite(v) ? v : 0.0; });
  x.array() -= x.mean();
  const Spectrum spectrum = amplitude_spectrum(x, run.dt, Window::hann, 4 * x.size());
  Index line = 0;
  constexpr Index leakage = 6;  // lines of the padded spectrum that a slow drift can reach
  spectrum.line.tail(std::max<Index>(1, spectrum.line.size() - leakage)).cwiseAbs2().maxCoeff(&line);
  return spectrum.frequency(line + leakage);
}

double median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return values[values.size() / 2];
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
