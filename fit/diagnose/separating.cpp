#include "fit/diagnose/separating.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <vector>

#include <fmt/format.h>

#include "core/model/simulate.h"
#include "core/files/text_file.h"

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

/// A run that could be recorded instead of one that was.
struct Variation {
  std::string what;
  Run run;
  std::optional<double> release_load;
};

void put(Run& run, const std::string& column, const VectorXd& value) {
  for (Channel& c : run.channels)
    if (c.name == column) c.value = value, c.missing = 0;
}

/// Shaft angle as the fit has smoothed it, about its first value `size` times as large and run through `speed` times as fast.
VectorXd moved(const VectorXd& angle, double size, double speed) {
  VectorXd out(angle.size());
  for (Index k = 0; k < out.size(); ++k) out[k] = angle[0] + size * (angle[std::min(angle.size() - 1, static_cast<Index>(std::lround(speed * static_cast<double>(k))))] - angle[0]);
  return out;
}

/// The load at the calibration element whose release rings as this pluck did at first.
double release_load_of(const Arrival& arrival, std::size_t r) {
  const RunResidual& run = arrival.joint.runs()[r];
  const RunResidual::Prediction p = run.predict(arrival.joint.theta(r));
  const AeroelasticModel bare(run.model().rig(), run.model().basis(), run.model().circulation());
  SimulateProblem unit{bare, arrival.joint.theta(r).head(static_cast<Index>(bare.parameters().size())), run.run(), {}, 1.0, {}};
  const double of_one_newton = simulate(unit).run.channel("gauge").value[0];
  return (p.output(0, 0) - p.offset[0]) / of_one_newton;
}

std::vector<Variation> variations(const Arrival& arrival, std::size_t r) {
  constexpr double water = 998.2, air = 1.2, between = 100;
  const RunResidual& residual = arrival.joint.runs()[r];
  const Run& run = residual.run();
  const std::string name = base_name(run.file);
  std::vector<Variation> all;
  if (run.kind == RunKind::pluck) {
    const double load = release_load_of(arrival, r);
    all.push_back({name, run, load});
    for (const double factor : {0.3, 3.0}) all.push_back({fmt::format("{} released from {} times the load", name, factor), run, factor * load});
    Run other = run;
    other.density = run.density > between ? air : water;
    other.medium = run.density > between ? "air" : "water";
    all.push_back({fmt::format("{} in {}", name, other.medium), other, load});
  } else if (run.kind == RunKind::step && residual.motion().unknowns() > 0) {
    const RunResidual::Prediction p = residual.predict(arrival.joint.theta(r));
    const VectorXd angle = p.motion.angle.array() + p.angle_offset[0];
    const auto add = [&](const std::string& what, double size, double fast, double towing) {
      Variation v{what.empty() ? name : name + " " + what, run, {}};
      put(v.run, "alpha", moved(angle, size, fast));
      v.run.speed *= towing;
      all.push_back(std::move(v));
    };
    add("", 1, 1, 1);
    add("with a step three times as large", 3, 1, 1);
    add("with a step twice as fast", 1, 2, 1);
    add("with a step half as fast", 1, 0.5, 1);
    add("towed at half the speed", 1, 1, 0.5);
    add("towed at 1.5 times the speed", 1, 1, 1.5);
  }
  return all;
}

/// What the gauge would read, without its own zero.
VectorXd gauge(const Arrival& arrival, std::size_t r, const Variation& v) {
  SimulateProblem problem{*arrival.model, arrival.joint.theta(r), v.run, {}, v.release_load, {}};
  const VectorXd read = simulate(problem).run.channel("gauge").value;
  return read.array() - read.mean();
}

}  // namespace

std::optional<SeparatingRecording> separating_recording(const Arrival& one, const Arrival& other) {
  const Rig& rig = one.model->rig();
  if (rig.gauge_element == 0) return {};
  constexpr double clearly = 2, noise = 1;
  std::optional<SeparatingRecording> best;
  for (std::size_t r = 0; r < one.joint.runs().size(); ++r) {
    const RunResidual& run = one.joint.runs()[r];
    if (run.channels().front() != "gauge") continue;
    double now = 0;
    try {
      const std::vector<Variation> all = variations(one, r);
      for (const Variation& v : all) {
        const VectorXd difference = gauge(one, r, v) - gauge(other, r, v);
        const double rms = std::sqrt(difference.squaredNorm() / static_cast<double>(difference.size())) / run.sigma(0);
        if (&v == &all.front()) now = rms;
        else if (std::isfinite(rms) && rms > noise && rms > clearly * now && (!best || rms > best->difference)) best = {v.what, rms, now};
      }
    } catch (const std::runtime_error&) {  // a variation that cannot be simulated (a law that makes it run away) is none to recommend
    }
  }
  return best;
}

}  // namespace unrig
