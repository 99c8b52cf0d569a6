#include "core/check/run_estimate.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <limits>
#include <numbers>
#include <vector>

#include "core/model/wagner.h"
#include "core/numerics/median.h"
#include "core/numerics/spectrum.h"
#include "core/propagate/response.h"
#include "core/rig/structure.h"
#include "core/run/motion.h"

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::VectorXd;
using std::numbers::pi;
constexpr double nan = std::numeric_limits<double>::quiet_NaN();

/// Missing samples on the line between their neighbours.
VectorXd without_gaps(VectorXd x) {
  Index last = -1;
  for (Index k = 0; k < x.size(); ++k) {
    if (!std::isfinite(x[k])) continue;
    for (Index j = last + 1; j < k; ++j) x[j] = last < 0 ? x[k] : x[last] + (x[k] - x[last]) * static_cast<double>(j - last) / static_cast<double>(k - last);
    last = k;
  }
  for (Index j = last + 1; j < x.size(); ++j) x[j] = last < 0 ? 0.0 : x[last];
  return x;
}

VectorXd median_filtered(const VectorXd& x) {
  constexpr Index half = 2;
  VectorXd y = x;
  for (Index k = half; k + half < x.size(); ++k) y[k] = median({x.begin() + k - half, x.begin() + k + half + 1});
  return y;
}

/// Twice with binomial weights of width 5: a standard deviation of 1.4 samples.
VectorXd smoothed(VectorXd x) {
  for (int pass = 0; pass < 2; ++pass) {
    VectorXd y = x;
    for (Index k = 2; k + 2 < x.size(); ++k) y[k] = (x[k - 2] + 4 * x[k - 1] + 6 * x[k] + 4 * x[k + 1] + x[k + 2]) / 16;
    x = y;
  }
  return x;
}

double median_of(const VectorXd& x, Index first, Index last) { return median({x.begin() + first, x.begin() + last}); }

StrongestLine line_of(VectorXd x, double dt) {
  x.array() -= x.mean();
  const Spectrum spectrum = amplitude_spectrum(x, dt, Window::hann, 4 * x.size());
  constexpr Index leakage = 6;  // lines of the padded spectrum that a slow drift can reach
  if (spectrum.line.size() < 4 * leakage) return {};
  const VectorXd power = spectrum.line.tail(spectrum.line.size() - leakage).cwiseAbs2();
  Index line = 0;
  const double most = power.maxCoeff(&line);
  double place = static_cast<double>(line + leakage);
  if (line > 0 && line + 1 < power.size() && power[line - 1] > 0 && power[line + 1] > 0) {
    const double l = std::log(power[line - 1]), m = std::log(most), r = std::log(power[line + 1]);
    if (l + r - 2 * m < 0) place += 0.5 * (l - r) / (l + r - 2 * m);
  }
  return {spectrum.spacing * place, most / std::max(1e-300, median({power.begin(), power.end()}))};
}

/// Amplitude and phase of a vibration in four of its periods from a sample on, under a Hann window, without mean and slope.
std::complex<double> ringing(const VectorXd& y, double dt, Index from, Index last, double hertz) {
  constexpr double periods = 4;
  const Index n = std::min(last - from, static_cast<Index>(std::lround(periods / (hertz * dt))));
  if (n < 8) return nan;
  const VectorXd weight = window_weights(Window::hann, n);
  std::complex<double> sum = 0;
  for (Index k = 0; k < n; ++k) sum += weight[k] * y[from + k] * std::polar(1.0, -2 * pi * hertz * dt * static_cast<double>(k));
  std::complex<double> mean = 0;
  for (Index k = 0; k < n; ++k) mean += weight[k] * std::polar(1.0, -2 * pi * hertz * dt * static_cast<double>(k));
  const double level = weight.dot(y.segment(from, n)) / weight.sum();
  return 2.0 * (sum - level * mean) / weight.sum();
}

/// Few samples say nothing.
constexpr Index least_samples = 64;

/// The first motion between two rests, of any column that turns from one level to another.
StepMotion motion_in(const VectorXd& column, double dt, double rest) {
  StepMotion motion;
  constexpr Index least_rest = 16;
  if (column.size() < least_samples) return motion;
  const VectorXd angle = median_filtered(without_gaps(column));
  const std::vector<Interval> moves = moving(column, noise_level(column));
  if (moves.empty()) return motion;
  const Index long_enough = std::max(least_rest, static_cast<Index>(rest / dt));
  motion.begin = moves.front().first;
  motion.end = moves.front().last;
  std::size_t next = 1;
  for (; next < moves.size() && moves[next].first - motion.end < long_enough; ++next) motion.end = moves[next].last;
  motion.last = next < moves.size() ? moves[next].first : column.size();
  if (motion.begin < least_rest || motion.last - motion.end < long_enough) return motion;
  motion.onset = median_of(angle, 0, motion.begin);
  const double behind = median_of(angle, motion.end, motion.last);
  motion.step = behind - motion.onset;
  motion.angle = angle;
  motion.angle.head(motion.begin).setConstant(motion.onset);
  motion.angle.segment(motion.end, motion.last - motion.end).setConstant(behind);
  motion.angle = smoothed(motion.angle);
  motion.found = true;
  return motion;
}

/// The record around its first motion, where it is too long to be looked at whole.
constexpr Index longest = 16384;

Run shortened(const Run& run, Index begin) {
  if (run.samples() <= longest) return run;
  const Index first = std::clamp<Index>(begin - longest / 4, 0, run.samples() - longest);
  Run part = run;
  for (Channel& channel : part.channels) channel.value = VectorXd(channel.value.segment(first, longest));
  return part;
}

/// The gauge as deviation from where it was, driven with the smooth angle.
VectorXd simulated(const CheckModel& check, const Run& run, const StepMotion& motion, double stiffness, double slope, double apparent = 1) {
  const AeroelasticModel& model = check.model();
  VectorXd theta = model.start_values();
  theta[model.index("normal.stiffness_scale")] = std::clamp(stiffness, 1e-6, 1e6);
  theta[model.index("normal_force_slope")] *= slope;
  theta[model.index("apparent_mass_coefficient")] = apparent;
  theta[model.index("torsion.stiffness_scale")] = theta[model.index("normal.stiffness_scale")];
  Conditions conditions = conditions_of(run);
  conditions.prescribed_pitch = true;
  conditions.mount = conditions.force = false;
  conditions.onset_angle = motion.onset;
  LinearSystem system = model.system(conditions, theta, {"gauge"});
  for (DualMatrix* m : {&system.A, &system.B, &system.C, &system.D}) m->partial.clear();
  const Motion spline = interpolated_motion(motion.angle, run.dt);
  VectorXd start = VectorXd::Zero(system.states());
  start.segment(system.motion, 3) << spline.angle[0], spline.rate[0], spline.acceleration[0];
  return drive(system, exact_step(system, run.dt), DualMatrix(start), run.samples(), spline.jerk, {}, Partials::none).output.col(0);
}

double fluid_share(const CheckModel& check, double density) {
  const double with = coupled_frequencies(check.rig(), check.basis(), density, 1)[0], without = coupled_frequencies(check.rig(), check.basis(), density, 0)[0];
  return 1 - with * with / (without * without);
}

/// A line counts where its power is this many times the median: noise of a record of 2^15 lines reaches 15 (exp(-15) 2^15 = 0.01).
constexpr double stands_out = 30;

/// Beyond this the lift curve bends (the samples: 2, 3 and 4 degrees against 25).
constexpr double stall = 12 * pi / 180;
constexpr double stalled_slope = 0.55;

/// Line of a step next to the reference, among the strongest peaks within a factor of three of the modelled frequency; 0: none.
double ring_line(const VectorXd& gauge, double dt, double modelled, double reference) {
  VectorXd x = gauge;
  x.array() -= x.mean();
  constexpr Index least = 64, leakage = 8;
  constexpr double width = 3;
  if (x.size() < least) return 0;
  const Spectrum spectrum = amplitude_spectrum(x, dt, Window::hann, 4 * x.size());
  const VectorXd power = spectrum.line.cwiseAbs2();
  const double floor = median({power.begin(), power.end()});
  std::vector<Peak> peaks = peaks_above(power, VectorXd::Constant(power.size(), floor), stands_out);
  std::erase_if(peaks, [&](const Peak& p) {
    const double ratio = p.position * spectrum.spacing / modelled;
    return ratio < 1 / width || ratio > width || p.line < leakage;
  });
  constexpr std::size_t most = 8;
  constexpr double weakest = 1e-3;  // of the strongest: side lobes of the window are below
  double best = 0, least_distance = 1e9;
  for (std::size_t i = 0; i < std::min(most, peaks.size()); ++i) {
    if (peaks[i].power < weakest * peaks.front().power) break;
    const double hertz = peaks[i].position * spectrum.spacing, distance = std::abs(2 * std::log(hertz / modelled) - reference);
    if (distance < least_distance) best = hertz, least_distance = distance;
  }
  return best;
}

/// Standard deviation about a straight line, over the noise.
double restlessness(const VectorXd& x) {
  const VectorXd t = VectorXd::LinSpaced(x.size(), -1, 1);
  const VectorXd off = (x.array() - x.mean()).matrix() - t * (t.dot(x) / t.squaredNorm());
  return std::sqrt(off.squaredNorm() / static_cast<double>(x.size())) / std::max(1e-300, noise_level(x));
}

/// Standard deviation about a line over the noise, of a channel at rest and of one that rings. Over the samples the gauge has 1.8 or more, and
/// the angle (median of five) below 4 in all but some six steps, of which the largest has 24.6.
constexpr double quiet = 1.5, restless = 4;

/// Whether angle and gauge have changed places: behind the step the angle rings and the gauge does not.
bool look_exchanged(const VectorXd& angle, const VectorXd& gauge) {
  return restlessness(angle) > restless && restlessness(gauge) < quiet;
}

/// Whether the gauge rests, steps and rests again without ringing, as an angle does and a gauge does not.
bool gauge_is_the_step(const Run& run, double rest) {
  const VectorXd& gauge = run.channel("gauge").value;
  const StepMotion motion = motion_in(gauge, run.dt, rest);
  if (!motion.found) return false;
  const VectorXd behind = median_filtered(without_gaps(gauge)).segment(motion.end, motion.last - motion.end);
  return restlessness(behind) < quiet;
}

void estimate_step(const CheckModel& check, const Run& whole, double reference, RunEstimate& found) {
  const double rest = 1 / found.modelled;
  StepMotion motion = step_motion(whole, rest);
  if (!motion.found) {
    found.exchanged = gauge_is_the_step(whole, rest);
    return;
  }
  const Run run = shortened(whole, motion.begin);
  if (run.samples() < whole.samples()) motion = step_motion(run, rest);
  if (!motion.found) return;
  found.onset = motion.onset;
  found.step = motion.step;
  const VectorXd gauge = without_gaps(run.channel("gauge").value);
  found.line = ring_line(gauge.segment(motion.end, motion.last - motion.end), run.dt, found.modelled, reference);
  if (found.line > 0) found.stiffness = 2 * std::log(found.line / found.modelled);
  found.moves = true;
  found.exchanged = look_exchanged(median_filtered(without_gaps(run.channel("alpha").value)).segment(motion.end, motion.last - motion.end), gauge.segment(motion.end, motion.last - motion.end));
  found.stalled = std::max(std::abs(motion.onset), std::abs(motion.onset + motion.step)) > stall;
  const VectorXd expected = simulated(check, run, motion, std::exp(std::isfinite(found.stiffness) ? found.stiffness : reference), found.stalled ? stalled_slope : 1.0);
  if (!expected.allFinite()) return;
  const Index late = motion.end + (motion.last - motion.end) / 2;
  const auto change = [&](const VectorXd& y) { return y.segment(late, motion.last - late).mean() - y.head(motion.begin).mean(); };
  const double scatter = noise_level(gauge);
  found.load_change = change(gauge);
  if (run.speed > 0 && std::abs(found.load_change) > 3 * scatter) {
    const double ratio = found.load_change / change(expected);
    found.steady = std::log(std::abs(ratio));
    found.reversed = ratio < 0;
  }
  if (found.line > 0) {
    const std::complex<double> measured = ringing(gauge, run.dt, motion.end, motion.last, found.line), model = ringing(expected, run.dt, motion.end, motion.last, found.line);
    if (std::abs(measured) > 3 * scatter) {
      found.ring = std::log(std::abs(measured) / std::abs(model));
      found.ring_phase = std::arg(measured / model);
    } else {  // a line so faint is any
      found.line = 0;
      found.stiffness = nan;
    }
  }
}

Basis few_modes(const Rig& rig) {
  constexpr Index most_normal = 5, most_torsion = 1;
  return make_basis(rig, std::min<Index>(most_normal, chain_modes(rig.normal).omega.size()), std::min<Index>(most_torsion, chain_modes(rig.torsion).omega.size()));
}

}  // namespace

RunEstimate::RunEstimate() : stiffness(nan), steady(nan), ring(nan) {}

CheckModel::CheckModel(const Rig& rig) : model_(rig, rig.is_modal() ? Basis{} : few_modes(rig), wagner(Wagner::within_1e4)) {}

bool shaft_turns(const VectorXd& angle) {
  constexpr Index least = 64;
  constexpr double clearly = 10;
  if (angle.size() < least) return false;
  const double noise = noise_level(angle);
  const VectorXd x = median_filtered(without_gaps(angle));
  return x.maxCoeff() - x.minCoeff() > clearly * noise && !moving(angle, noise).empty();
}

StrongestLine strongest_line(const VectorXd& x, double dt) {
  constexpr Index shortest = 1024, least = 32;
  if (x.size() < least) return {};
  StrongestLine best = line_of(x, dt);
  for (Index samples = x.size() / 2; samples >= shortest; samples /= 2)
    if (const StrongestLine line = line_of(x.head(samples), dt); line.over_noise > best.over_noise) best = line;
  return best;
}

StepMotion step_motion(const Run& run, double rest) {
  const Channel* alpha = run.find("alpha");
  return alpha ? motion_in(alpha->value, run.dt, rest) : StepMotion{};
}

RunEstimate estimate(const CheckModel& check, const Run& run, double reference) {
  RunEstimate found;
  found.kind = run.kind;
  const Rig& rig = check.rig();
  if (rig.gauge_element == 0 || !run.find("gauge")) return found;
  found.modelled = coupled_frequencies(rig, check.basis(), run.density)[0];
  found.fluid_share = fluid_share(check, run.density);
  found.periods = run.dt * static_cast<double>(run.samples()) * found.modelled;
  if (run.samples() < least_samples) return found;
  found.looked_at = run.kind == RunKind::step || run.kind == RunKind::pluck;
  found.nyquist_ratio = 0.5 / (run.dt * found.modelled);
  if (const Channel* alpha = run.find("alpha")) {
    const VectorXd angle = median_filtered(without_gaps(alpha->value));
    found.largest_angle = angle.cwiseAbs().maxCoeff();
    found.turns = shaft_turns(alpha->value);
  }
  if (run.kind == RunKind::step) {
    estimate_step(check, run, reference, found);
  } else if (run.kind == RunKind::pluck) {
    const Run part = shortened(run, 0);
    const StrongestLine line = strongest_line(without_gaps(part.channel("gauge").value), part.dt);
    if (line.over_noise > stands_out) {
      found.line = line.hertz;
      found.stiffness = 2 * std::log(line.hertz / found.modelled);
    }
  }
  return found;
}

Waveform waveform(const CheckModel& check, const Run& whole, const RunEstimate& estimated, double stiffness, double apparent) {
  Waveform found;
  if (!estimated.moves || !std::isfinite(estimated.steady) || estimated.reversed) return found;
  const double rest = 1 / estimated.modelled;
  StepMotion motion = step_motion(whole, rest);
  const Run run = shortened(whole, motion.begin);
  if (run.samples() < whole.samples()) motion = step_motion(run, rest);
  if (!motion.found) return found;
  constexpr double least_slope = 0.2, most_slope = 1.5, periods = 4, latest = 0.03;
  const VectorXd expected = simulated(check, run, motion, std::exp(stiffness), std::clamp((estimated.stalled ? stalled_slope : 1.0) * std::exp(estimated.steady), least_slope, most_slope), std::exp(apparent));
  if (!expected.allFinite()) return found;
  const VectorXd gauge = without_gaps(run.channel("gauge").value);
  const Index widest = std::min<Index>(static_cast<Index>(latest / run.dt), motion.begin);
  const Index first = motion.begin, count = std::min(motion.last - widest, motion.end + static_cast<Index>(periods / (estimated.modelled * run.dt))) - first;
  constexpr Index least = 32;
  if (count < least) return found;
  const auto scatter = [](const VectorXd& x) { return std::sqrt((x.array() - x.mean()).square().mean()); };
  const VectorXd measured = gauge.segment(first, count);
  const double varies = scatter(measured);
  const auto misfit = [&](Index late) { return scatter(measured - expected.segment(first - late, count)) / varies; };
  found.found = true;
  found.misfit = found.misfit_if_late = misfit(0);
  for (Index late = -widest; late <= widest; ++late)
    if (const double other = misfit(late); other < found.misfit_if_late) {
      found.misfit_if_late = other;
      found.late = run.dt * static_cast<double>(late);
    }
  return found;
}

}  // namespace unrig
