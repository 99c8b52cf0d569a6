#include "fit/propose/candidate_runs.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>

#include <fmt/format.h>

#include "core/files/text_file.h"
#include "core/numerics/smooth_ramp.h"
#include "core/rig/structure.h"

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

constexpr double degree = std::numbers::pi / 180;

/// The run at hand that is nearest to what is planned: of its kind before its fluid before its speed.
std::size_t nearest(const std::vector<Run>& runs, RunKind kind, double density, double speed) {
  const auto distance = [&](const Run& run) {
    return (run.kind == kind ? 0 : 1e6) + 1e3 * std::abs(std::log((run.density + 1e-3) / (density + 1e-3))) + std::abs(run.speed - speed);
  };
  return static_cast<std::size_t>(std::min_element(runs.begin(), runs.end(), [&](const Run& a, const Run& b) { return distance(a) < distance(b); }) - runs.begin());
}

/// The media of the limits, else those of the runs.
std::vector<Medium> media_of(const Limits& limits, const std::vector<Run>& runs) {
  if (!limits.media.empty()) return limits.media;
  std::vector<Medium> media;
  for (const Run& run : runs)
    if (std::none_of(media.begin(), media.end(), [&](const Medium& m) { return std::abs(m.density - run.density) <= 0.05 * run.density; })) media.push_back({run.medium, run.density});
  return media;
}

std::string in(const Medium& medium) { return medium.name.empty() ? fmt::format("at {:.4g} kg/m^3", medium.density) : "in " + medium.name; }

/// Conditions of a planned run, without columns.
CandidateRun planned(RunKind kind, const Medium& medium, double speed, const std::vector<Run>& runs) {
  CandidateRun candidate;
  candidate.like = nearest(runs, kind, medium.density, speed);
  Run& run = candidate.run;
  run.kind = kind;
  run.medium = medium.name;
  run.density = medium.density;
  run.speed = speed;
  run.dt = runs[candidate.like].dt;
  return candidate;
}

Index samples_of(const CandidateRun& candidate, const Limits& limits, const std::vector<Run>& runs) {
  const Run& like = runs[candidate.like];
  const Index samples = limits.duration ? static_cast<Index>(std::floor(*limits.duration / like.dt)) + 1 : like.samples();
  constexpr Index fewest = 64, most = 200000;
  return std::clamp(samples, fewest, most);
}

void put(Run& run, const char* name, const char* unit, const char* file_unit, double factor, VectorXd value) {
  Channel channel;
  channel.name = name;
  channel.unit = unit;
  channel.file_unit = file_unit;
  channel.factor = factor;
  channel.value = std::move(value);
  run.channels.push_back(std::move(channel));
}

void add_plucks(const Limits& limits, const std::vector<Run>& runs, std::vector<CandidateRun>& all) {
  for (const Medium& medium : media_of(limits, runs))
    for (const double share : {1.0, 0.5, 0.2}) {
      CandidateRun c = planned(RunKind::pluck, medium, 0, runs);
      c.release_load = share * *limits.pluck_load;
      put(c.run, "weight", "1", "1", 1, VectorXd::Ones(samples_of(c, limits, runs)));  // a run file has one column at least
      c.what = fmt::format("free decay {}, released from {:.4g} N", in(medium), *c.release_load);
      all.push_back(std::move(c));
    }
}

/// From one angle to another and, where asked for, back; `rate` is the largest on the way. The largest slope of the ramp is 35/16.
VectorXd turn(Index samples, double dt, double from, double to, double rate, bool back) {
  const double rise = 35.0 / 16 * std::abs(to - from) / rate, whole = dt * static_cast<double>(samples), begin = 0.15 * whole, hold = 0.1 * whole;
  VectorXd angle(samples);
  for (Index k = 0; k < samples; ++k) {
    const double t = dt * static_cast<double>(k) - begin;
    const double there = smooth_ramp(t / rise) - (back ? smooth_ramp((t - rise - hold) / rise) : 0);
    angle[k] = from + (to - from) * there;
  }
  return angle;
}

std::vector<double> speeds_of(const Limits& limits, const std::vector<Run>& runs) {
  std::vector<double> speeds;
  const auto add = [&](double speed) {
    if (std::none_of(speeds.begin(), speeds.end(), [&](double known) { return std::abs(known - speed) <= 0.1 * speed; })) speeds.push_back(speed);
  };
  if (limits.speed) add(*limits.speed), add(0.5 * *limits.speed);
  for (const Run& run : runs)
    if (run.speed > 0 && (!limits.speed || run.speed <= *limits.speed)) add(run.speed);
  constexpr std::size_t most = 3;
  if (speeds.size() > most) speeds.resize(most);
  return speeds;
}

void add_turns(const Limits& limits, const std::vector<Run>& runs, std::vector<CandidateRun>& all) {
  const auto [low, high] = *limits.angle;
  const double middle = (low + high) / 2;
  const std::pair<double, double> ways[] = {{low, high}, {middle, high}, {high, low}};
  for (const Medium& medium : media_of(limits, runs)) {
    constexpr double liquid = 100;  // kg/m^3: a stream of water is not one of air
    std::vector<Run> same;
    for (const Run& run : runs)
      if ((run.density > liquid) == (medium.density > liquid)) same.push_back(run);
    for (const double speed : speeds_of(limits, same))
      for (const auto& [from, to] : ways)
        for (const double rate : {limits.rate, limits.rate / 4})
          for (const bool back : {false, true}) {
            if (back && (from != low || rate < limits.rate)) continue;
            CandidateRun c = planned(RunKind::step, medium, speed, runs);
            c.angle_noise = limits.angle_noise.value_or(0);
            const Index samples = samples_of(c, limits, runs);
            const double rise = 35.0 / 16 * std::abs(to - from) / rate, whole = c.run.dt * static_cast<double>(samples);
            if ((back ? 2 : 1) * rise > 0.5 * whole) continue;  // no time to settle
            put(c.run, "alpha", "rad", "deg", degree, turn(samples, c.run.dt, from, to, rate, back));
            c.what = fmt::format("turn from {:.3g} to {:.3g} deg{} at up to {:.4g} deg/s, {:.4g} m/s {}", from / degree, to / degree, back ? " and back" : "", rate / degree, speed, in(medium));
            all.push_back(std::move(c));
          }
  }
}

/// Tones through half to twice the lowest frequency, as evenly in time as a linear sweep has them.
void add_sweeps(const Limits& limits, const Rig& rig, const std::vector<Run>& runs, std::vector<CandidateRun>& all) {
  for (const Medium& medium : media_of(limits, runs)) {
    const double middle = lowest_frequency(rig, medium.density);
    for (const double share : {1.0, 0.3}) {
      CandidateRun c = planned(RunKind::forced, medium, 0, runs);
      const Index samples = samples_of(c, limits, runs);
      const double whole = c.run.dt * static_cast<double>(samples), first = 0.5 * middle, last = std::min(2 * middle, 0.2 / c.run.dt), load = share * *limits.force;
      if (!(last > first)) continue;
      VectorXd force(samples);
      for (Index k = 0; k < samples; ++k) {
        const double t = c.run.dt * static_cast<double>(k);
        force[k] = load * std::sin(2 * std::numbers::pi * (first * t + (last - first) * t * t / (2 * whole)));
      }
      put(c.run, "force", "N", "N", 1, std::move(force));
      c.what = fmt::format("sweep of the force from {:.3g} to {:.3g} Hz, amplitude {:.4g} N, {}", first, last, load, in(medium));
      all.push_back(std::move(c));
    }
  }
}

void add_repeats(const std::vector<Run>& runs, std::vector<CandidateRun>& all) {
  for (std::size_t r = 0; r < runs.size(); ++r) {
    CandidateRun c;
    c.run = runs[r];
    c.like = r;
    c.repeat = true;
    c.what = base_name(runs[r].file) + " over again";
    all.push_back(std::move(c));
  }
}

}  // namespace

std::vector<CandidateRun> candidate_runs(const Limits& limits, const Rig& rig, const std::vector<Run>& runs) {
  const bool has_step = std::any_of(runs.begin(), runs.end(), [](const Run& run) { return run.kind == RunKind::step; });
  std::vector<CandidateRun> all;
  if (limits.pluck_load && rig.takes_force()) add_plucks(limits, runs, all);
  if (limits.angle && !rig.is_modal()) {
    if (!has_step && !limits.angle_noise) throw InputError({limits.file, 0}, "turns of the shaft, and no step at hand shows how noisy its angle is", "wanted angle_noise = \"0.01 deg\"", "");
    add_turns(limits, runs, all);
  }
  if (limits.force && rig.takes_force()) add_sweeps(limits, rig, runs, all);
  if (all.empty()) throw InputError({limits.file, 0}, "no run within these limits is possible with this rig", "wanted pluck_load or force, or angles with a rate at which the record is long enough", "Rigs of modes have no turns; plucks and forces need [gauge] with calibration_element.");
  add_repeats(runs, all);
  return all;
}

}  // namespace unrig
