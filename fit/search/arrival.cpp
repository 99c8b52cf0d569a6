#include "fit/search/arrival.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>

#include <fmt/format.h>

#include "core/effects/effect.h"
#include "core/law/law_effect.h"
#include "core/numerics/in_parallel.h"
#include "fit/search/first_guess.h"
#include "fit/search/modal_start.h"
#include "fit/search/mode_order.h"
#include "fit/search/search_numbers.h"
#include "fit/likelihood/readings_noise.h"
#include "fit/uncertainty/undetermined.h"

namespace unrig {

JointProblem make_joint(const AeroelasticModel& model, const std::vector<Run>& runs, const std::vector<std::vector<MotionBasis::Window>>& windows, Eigen::Index horizon) {
  std::vector<RunResidual> residuals;
  for (std::size_t r = 0; r < runs.size(); ++r) residuals.emplace_back(model, runs[r], windows[r], RunOptions{horizon});
  return JointProblem(model, std::move(residuals));
}

void set_starts(JointProblem& joint, const std::map<std::string, double>& starts) {
  for (Unknown& u : joint.unknowns())
    if (const auto found = starts.find(joint.parameter(u).name); found != starts.end()) {
      const Parameter& p = joint.parameter(u);
      const auto [lower, upper] = bounds_at(joint.model(), u.parameter, found->second);
      if (!(found->second >= lower && found->second <= upper))
        throw InputError({"--start", 0}, fmt::format("{}={:g}", p.name, found->second), fmt::format("wanted a value from {:g} to {:g}", lower, upper), "");
      u.value = found->second;
    }
}

namespace {

using Eigen::Index;
using Eigen::VectorXd;
using Windows = std::vector<std::vector<MotionBasis::Window>>;

void tell(const FitProblem& problem, const std::string& what) {
  if (problem.progress) problem.progress(what);
}

/// Continues `next` from the values of `last`.
void carry_over(const JointProblem& last, JointProblem& next) {
  for (Unknown& u : next.unknowns())
    for (const Unknown& known : last.unknowns())
      if (u.parameter == known.parameter && u.run == known.run) u = known;
  for (std::size_t r = 0; r < next.runs().size(); ++r) next.runs()[r].start_from(last.runs()[r]);
}

/// Horizons of the growing window, in samples; the last, 0, is the whole record.
std::vector<Index> growing_horizons(const std::vector<Run>& runs) {
  Index longest = 0;
  for (const Run& run : runs) longest = std::max(longest, run.samples());
  constexpr Index shortest = 40, growth = 8;
  std::vector<Index> horizons{0};
  for (Index horizon = longest / growth; horizon >= shortest; horizon /= growth) horizons.insert(horizons.begin(), horizon);
  return horizons;
}

/// Follows the growing window through the stages [first, last) from the values of the joint fit.
void follow(Arrival& arrival, const FitProblem& problem, const std::vector<Index>& horizons, std::size_t first, std::size_t last, const ArrivalEffort& effort) {
  const JointProblem start = arrival.joint;
  for (std::size_t stage = first; stage < last; ++stage) {
    JointProblem longer = make_joint(*arrival.model, problem.runs, arrival.windows, horizons[stage]);
    carry_over(arrival.joint, longer);
    if (!std::isfinite(longer.chi2())) carry_over(start, longer);  // over a short window a rig that flutters may fit, which the whole record is too long for
    arrival.joint = std::move(longer);
    const bool whole = horizons[stage] == 0;
    tell(problem, whole ? "fitting the whole record" : fmt::format("fitting the first {} samples", horizons[stage]));
    JointProblem::SolveOptions options;
    options.prior = !whole;
    options.tolerance = whole ? 1e-7 : 1e-2;
    options.iterations = whole ? effort.iterations : std::min(12, effort.iterations);
    options.precision = effort.precision;
    options.most_evaluations = effort.evaluations;
    solve(arrival, options);
  }
}

/// Start values around those of `joint`: stiffness of torsion (of modal rigs: of every second mode) and of the others times a factor each, and damping ratios of modes that a
/// resonance nearby still moves.
void spread(JointProblem& joint, double torsion, double others) {
  constexpr double wide = 0.03;  // a resonance three per cent wide to either side
  for (Unknown& u : joint.unknowns()) {
    const Parameter& p = joint.parameter(u);
    if (u.held || p.role != Role::stiffness) continue;
    const bool every_second = p.mode % 2 == 1;
    u.value = std::clamp(u.value * (p.torsion || every_second ? torsion : others), p.lower, p.upper);
    if (p.mode < 0) continue;
    const VectorXd theta = joint.theta(0);
    for (Unknown& damping : joint.unknowns())
      if (damping.parameter == u.parameter + 1 && !damping.held) damping.value = std::max(damping.value, 2 * wide * std::sqrt(u.value * theta[u.parameter - 1]));
  }
}

/// Once more from stiffnesses around the first guess; the best after the early stages goes on.
Arrival try_other_starts(const Arrival& start, const FitProblem& problem, const std::vector<Index>& horizons, const ArrivalEffort& effort) {
  const std::size_t early = std::min<std::size_t>(2, horizons.size() - 1);
  std::optional<Arrival> best;
  double least = std::numeric_limits<double>::infinity();
  const bool one_stiffness = problem.rig.modal.size() == 1;
  for (const double torsion : {0.5, 1.0, 2.0})
    for (const double others : {0.5, 1.0, 2.0}) {
      if ((torsion == 1 && others == 1 && !problem.rig.is_modal()) || (torsion != 1 && one_stiffness)) continue;
      Arrival other = start;
      spread(other.joint, torsion, others);
      tell(problem, "trying other starts");
      follow(other, problem, horizons, 0, early, effort);
      if (const double chi2 = other.joint.chi2(); chi2 < least || !best) {
        least = chi2;
        best = other;
      }
    }
  follow(*best, problem, horizons, early, horizons.size(), effort);
  return *best;
}

/// All the way from the values in `start`.
Arrival grow(Arrival start, const FitProblem& problem, const ArrivalEffort& effort) {
  const std::vector<Index> horizons = growing_horizons(problem.runs);
  Arrival arrival = start;
  follow(arrival, problem, horizons, 0, horizons.size(), effort);
  if (!effort.other_starts || horizons.size() < 2 || arrival.reduced_chi2() < twice_the_noise) return arrival;
  Arrival other = try_other_starts(start, problem, horizons, effort);
  return other.reduced_chi2() < arrival.reduced_chi2() ? other : arrival;
}

/// Whether the fit follows its runs to their noise, that of measured inputs included.
bool follows(Arrival arrival) {
  for (std::size_t r = 0; r < arrival.joint.runs().size(); ++r) arrival.joint.runs()[r].settle_noise(arrival.joint.theta(r));
  return arrival.reduced_chi2() < twice_the_noise;
}

/// Of a rig known as modes: over the whole record at once, from the first guess and from the recordings' spectra. A window that grows may lose a mode that is near where it should be:
/// it grows only where neither follows the runs.
Arrival arrive_at_modes(const Arrival& start, const FitProblem& problem, const ArrivalEffort& effort) {
  JointProblem::SolveOptions options;
  options.iterations = effort.iterations;
  options.precision = effort.precision;
  options.most_evaluations = effort.evaluations;
  std::optional<Arrival> best;
  for (const bool from_spectra : {false, true}) {
    Arrival other = start;
    other.joint = make_joint(*start.model, problem.runs, start.windows, 0);
    carry_over(start.joint, other.joint);
    hold_undetermined(other.joint);
    if (from_spectra && !start_modes_from_spectra(other.joint)) continue;
    tell(problem, from_spectra ? "fitting from the lines of the spectra" : "fitting from the rig file's modes");
    solve(other, options);
    if (!best || other.joint.chi2() < best->joint.chi2()) best = std::move(other);
  }
  if (follows(*best)) return *best;
  Arrival grown = grow(start, problem, effort);
  return grown.joint.chi2() < best->joint.chi2() ? grown : *best;
}

Arrival first_guess(const FitProblem& problem, const std::shared_ptr<const AeroelasticModel>& model, const Windows& windows, const std::map<std::string, double>& starts) {
  Arrival start{model, windows, make_joint(*model, problem.runs, windows, growing_horizons(problem.runs).front())};
  set_starts(start.joint, starts);
  hold_undetermined(start.joint);
  guess_from_spectra(start.joint);
  return start;
}

/// Widens a window of a run's motion where the gauge still sees the shaft move beyond it: chi-square must fall by clearly more than the knots added.
bool widen_motion(RunResidual& run, const VectorXd& theta, std::vector<MotionBasis::Window>& windows) {
  bool widened = false;
  double before = -1;  // chi-square with the present windows, once it is known
  for (std::size_t w = 0; w < windows.size(); ++w) {
    const Interval knots = windows[w].knots;
    const Index more = std::max<Index>(10, knots.length() / 4);
    for (const bool later : {true, false}) {
      std::vector<MotionBasis::Window> trial = windows;
      Interval& k = trial[w].knots;
      if (later)
        k.last = std::min(w + 1 < trial.size() ? trial[w + 1].knots.first - 5 : run.run().samples() - 5, k.last + more);
      else
        k.first = std::max<Index>(w > 0 ? trial[w - 1].knots.last + 5 : 0, k.first - more);
      const auto added = static_cast<double>(k.length() - windows[w].knots.length());
      if (added <= 0) continue;
      RunResidual wider = run.with_motion(trial);
      wider.reject_spikes(theta);
      if (!(before >= 0)) before = run.solve(theta).chi2;
      const double scale = std::max(1.0, before / static_cast<double>(run.degrees_of_freedom()));
      const double gain = (before - wider.solve(theta).chi2) / scale;
      if (gain < added + 4 * std::sqrt(2 * added)) continue;  // four standard deviations of chi-square with that many degrees
      windows = trial;
      run = std::move(wider);
      before = -1;
      widened = true;
    }
  }
  return widened;
}

}  // namespace

double Arrival::reduced_chi2() const {
  double freedom = 0;
  for (const RunResidual& run : joint.runs()) freedom += run.is_aside() ? 0 : static_cast<double>(run.degrees_of_freedom());
  return joint.chi2() / freedom;
}

bool back_to_the_rig(JointProblem& joint, double factor) {
  const VectorXd rig = joint.model().start_values();
  bool any = false;
  for (Unknown& u : joint.unknowns()) {
    const Parameter& p = joint.parameter(u);
    const double there = rig[u.parameter];
    const bool known = std::isfinite(p.known_to), near = known ? std::abs(u.value - there) < factor * p.known_to : u.value > there / factor && u.value < factor * there;
    if (u.held || u.run >= 0 || !(known || there > 0) || near || !p.effect.empty()) continue;
    u.value = there;
    any = true;
  }
  return any;
}

std::vector<Unknown*> unknowns_of(JointProblem& joint, const std::string& id) {
  std::vector<Unknown*> own;
  for (Unknown& u : joint.unknowns())
    if (joint.parameter(u).effect == id) own.push_back(&u);
  return own;
}

JointProblem::Summary solve(Arrival& arrival, const JointProblem::SolveOptions& options) {
  JointProblem::Summary summary = arrival.joint.solve(options);
  arrival.evaluations += summary.evaluations;
  arrival.converged = summary.converged;
  arrival.message = summary.message;
  return summary;
}

Arrival arrive(const FitProblem& problem, const std::shared_ptr<const AeroelasticModel>& model, const ArrivalEffort& effort) {
  Windows windows;
  for (const Run& run : problem.runs) windows.push_back(windows_to_fit(run));
  const Arrival start = first_guess(problem, model, windows, problem.start);
  Arrival arrival = problem.rig.is_modal() ? arrive_at_modes(start, problem, effort) : grow(start, problem, effort);
  hold_undetermined(arrival.joint);
  Arrival renumbered = arrival;
  if (!number_modes_by_frequency(renumbered.joint)) return arrival;
  JointProblem::SolveOptions options;
  options.iterations = effort.iterations;
  solve(renumbered, options);
  constexpr double rounding = 1e-6;
  return renumbered.joint.chi2() < (1 + rounding) * arrival.joint.chi2() ? renumbered : arrival;
}

Arrival arrive_with_effects(const FitProblem& problem, const Arrival& like, const ArrivalEffort& effort) {
  std::map<std::string, double> starts = problem.start;
  for (const Unknown& u : like.joint.unknowns())
    if (const Parameter& p = like.joint.parameter(u); !p.effect.empty()) starts.emplace(p.name, u.value);
  Arrival arrival = grow(first_guess(problem, like.model, like.windows, starts), problem, effort);
  hold_undetermined(arrival.joint);
  return arrival;
}

void look_elsewhere(Arrival& arrival) {
  if (arrival.model->rig().is_modal()) return;
  const JointProblem& joint = arrival.joint;
  const bool as_expected = std::all_of(joint.runs().begin(), joint.runs().end(), [&, r = std::size_t{0}](const RunResidual& run) mutable {
    const auto freedom = static_cast<double>(run.degrees_of_freedom());
    constexpr double chance = 2;  // standard deviations: what it costs is a fit of twice the time
    return run.evaluate(joint.theta(r++), Partials::none).chi2 < freedom * (1 + chance * std::sqrt(2 / freedom));
  });
  if (as_expected) return;
  constexpr double clearly = 25, far = 1.5;  // five standard deviations; a factor of stiffness
  for (const auto& [torsion, normal] : {std::pair{1 / far, 1.0}, {far, 1.0}, {1.0, 1 / far}, {1.0, far}}) {
    Arrival other = arrival;
    spread(other.joint, torsion, normal);
    solve(other);
    if (other.joint.chi2() < arrival.joint.chi2() - clearly * std::max(1.0, arrival.reduced_chi2())) arrival = std::move(other);
  }
}

void refine(Arrival& arrival, const FitProblem& problem) {
  JointProblem& joint = arrival.joint;
  for (std::size_t r = 0; r < joint.runs().size(); ++r)
    if (!joint.runs()[r].is_aside()) joint.runs()[r].settle_noise(joint.theta(r));
  constexpr int rounds = 4;
  for (int round = 0; round < rounds; ++round) {
    std::vector<char> run_changed(joint.runs().size(), 0);
    in_parallel(run_changed.size(), [&](std::size_t r) {
      if (joint.runs()[r].is_aside()) return;
      const VectorXd theta = joint.theta(r);
      const bool rejected = joint.runs()[r].reject_spikes(theta) > 0;
      run_changed[r] = widen_motion(joint.runs()[r], theta, arrival.windows[r]) || rejected;
    });
    const bool changed = std::find(run_changed.begin(), run_changed.end(), 1) != run_changed.end();
    if (!changed && round > 0) break;
    tell(problem, "refining the motion");
    solve(arrival);  // the first time for the noise levels' sake
    if (!changed) break;
  }
  // How much noise the readings have of their own shows once the model lets through as much of the inputs' as the rig does.
  bool noisy_inputs = false;
  for (std::size_t r = 0; r < joint.runs().size(); ++r) noisy_inputs = noisy_inputs || (!joint.runs()[r].is_aside() && sigma_of_inputs(joint.runs()[r], joint.theta(r), 0) > 0);
  constexpr double hardly = 1e-3;
  double before = joint.chi2();
  for (int round = 0; noisy_inputs && round < rounds; ++round) {
    for (std::size_t r = 0; r < joint.runs().size(); ++r)
      if (!joint.runs()[r].is_aside()) joint.runs()[r].settle_noise(joint.theta(r));
    solve(arrival);
    const double now = joint.chi2();
    if (std::abs(now - before) < hardly * now) break;
    before = now;
  }
}

}  // namespace unrig
