#include "fit/fit.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>

#include <fmt/format.h>

#include "core/effects/effect.h"
#include "fit/first_guess.h"
#include "fit/fit_description.h"
#include "fit/joint_problem.h"
#include "fit/uncertainty.h"
#include "fit/undetermined.h"

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using Windows = std::vector<std::vector<MotionBasis::Window>>;

void tell(const FitProblem& problem, const std::string& what) {
  if (problem.progress) problem.progress(what);
}

JointProblem make_joint(const AeroelasticModel& model, const std::vector<Run>& runs, const Windows& windows, Index horizon) {
  std::vector<RunResidual> residuals;
  for (std::size_t r = 0; r < runs.size(); ++r) residuals.emplace_back(model, runs[r], windows[r], RunOptions{horizon});
  return JointProblem(model, std::move(residuals));
}

/// Continues `next` from the values of `last`.
void carry_over(const JointProblem& last, JointProblem& next) {
  for (std::size_t i = 0; i < next.unknowns().size(); ++i) {
    next.unknowns()[i].value = last.unknowns()[i].value;
    next.unknowns()[i].held = last.unknowns()[i].held;
    next.unknowns()[i].why_held = last.unknowns()[i].why_held;
  }
}

void solve(JointProblem& joint, FitResult& result, const JointProblem::SolveOptions& options = {}) {
  const JointProblem::Summary summary = joint.solve(options);
  result.evaluations += summary.evaluations;
  result.converged = summary.converged;
  result.message = summary.message;
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

/// Follows the growing window through the stages [first, last) from the values of `joint`.
JointProblem follow(JointProblem joint, const FitProblem& problem, const Windows& windows, const std::vector<Index>& horizons, std::size_t first, std::size_t last,
                    FitResult& result) {
  for (std::size_t stage = first; stage < last; ++stage) {
    JointProblem longer = make_joint(joint.model(), problem.runs, windows, horizons[stage]);
    carry_over(joint, longer);
    joint = std::move(longer);
    const bool whole = horizons[stage] == 0;
    tell(problem, whole ? "fitting the whole record" : fmt::format("fitting the first {} samples", horizons[stage]));
    JointProblem::SolveOptions options;
    options.prior = !whole;
    options.tolerance = whole ? 1e-7 : 1e-2;
    options.iterations = whole ? 50 : 12;
    solve(joint, result, options);
  }
  return joint;
}

double reduced_chi2(const JointProblem& joint) {
  double freedom = 0;
  for (const RunResidual& run : joint.runs()) freedom += static_cast<double>(run.degrees_of_freedom());
  return joint.chi2() / freedom;
}

/// From the rig file's values to the whole record by way of windows that grow from a few periods. Where that leaves the record unexplained, the early
/// stages are tried once more from stiffnesses around the first guess, and the best of them goes on.
JointProblem arrive(const AeroelasticModel& model, const FitProblem& problem, const std::map<std::string, double>& starts, const Windows& windows, FitResult& result) {
  const std::vector<Index> horizons = growing_horizons(problem.runs);
  JointProblem start = make_joint(model, problem.runs, windows, horizons.front());
  for (const auto& [name, value] : starts)
    for (Unknown& u : start.unknowns())
      if (start.parameter(u).name == name) u.value = value;
  hold_undetermined(start);
  guess_from_spectra(start);
  JointProblem joint = follow(start, problem, windows, horizons, 0, horizons.size(), result);
  constexpr double explained = 2;
  const double first_try = reduced_chi2(joint);
  if (first_try < explained || horizons.size() < 2) return joint;

  const std::size_t early = std::min<std::size_t>(2, horizons.size() - 1);
  JointProblem best = joint;
  double least = std::numeric_limits<double>::infinity();
  for (const double torsion : {0.5, 1.0, 2.0})
    for (const double normal : {0.5, 1.0, 2.0}) {
      if (torsion == 1 && normal == 1) continue;
      JointProblem other = start;
      for (Unknown& u : other.unknowns()) {
        const std::string& name = other.parameter(u).name;
        if (u.held || name.find("stiffness") == std::string::npos) continue;
        u.value = std::clamp(u.value * (name.starts_with("torsion") ? torsion : normal), other.parameter(u).lower, other.parameter(u).upper);
      }
      tell(problem, "trying other starts");
      other = follow(other, problem, windows, horizons, 0, early, result);
      if (const double chi2 = other.chi2(); chi2 < least) {
        least = chi2;
        best = other;
      }
    }
  best = follow(best, problem, windows, horizons, early, horizons.size(), result);
  return reduced_chi2(best) < first_try ? best : joint;
}

/// Widens a window of the motion where the gauge still sees the shaft move beyond it: chi-square must fall by clearly more than the knots added.
bool widen_motion(JointProblem& joint, const std::vector<Run>& runs, Windows& windows) {
  bool widened = false;
  for (std::size_t r = 0; r < runs.size(); ++r) {
    double before = -1;  // chi-square with the present windows, once it is known
    for (std::size_t w = 0; w < windows[r].size(); ++w) {
      const Interval knots = windows[r][w].knots;
      const Index more = std::max<Index>(10, knots.length() / 4);
      for (const bool later : {true, false}) {
        std::vector<MotionBasis::Window> trial = windows[r];
        Interval& k = trial[w].knots;
        if (later)
          k.last = std::min(w + 1 < trial.size() ? trial[w + 1].knots.first - 5 : runs[r].samples() - 5, k.last + more);
        else
          k.first = std::max<Index>(w > 0 ? trial[w - 1].knots.last + 5 : 0, k.first - more);
        const auto added = static_cast<double>(k.length() - windows[r][w].knots.length());
        if (added <= 0) continue;
        RunResidual wider = joint.runs()[r].with_motion(trial);
        const VectorXd theta = joint.theta(r);
        wider.reject_spikes(theta);
        if (!(before >= 0)) before = joint.runs()[r].solve(theta).chi2;
        const double scale = std::max(1.0, before / static_cast<double>(joint.runs()[r].degrees_of_freedom()));
        const double gain = (before - wider.solve(theta).chi2) / scale;
        if (gain < added + 4 * std::sqrt(2 * added)) continue;  // four standard deviations of chi-square with that many degrees
        windows[r] = trial;
        joint.runs()[r] = std::move(wider);
        before = -1;
        widened = true;
      }
    }
  }
  return widened;
}

void refine_motion(JointProblem& joint, const FitProblem& problem, Windows& windows, FitResult& result) {
  constexpr int rounds = 4;
  for (int round = 0; round < rounds; ++round) {
    Index rejected = 0;
    for (std::size_t r = 0; r < joint.runs().size(); ++r) rejected += joint.runs()[r].reject_spikes(joint.theta(r));
    const bool changed = widen_motion(joint, problem.runs, windows) || rejected > 0;
    if (!changed && round > 0) break;
    tell(problem, "refining the motion");
    solve(joint, result);  // the first time for the noise levels' sake
    if (!changed) break;
  }
}

/// Noise, motion, and what the data cannot determine: each looked at again once the model fits.
ParameterUncertainty settle(JointProblem& joint, const FitProblem& problem, Windows& windows, FitResult& result) {
  for (RunResidual& run : joint.runs()) {
    const std::size_t r = static_cast<std::size_t>(&run - joint.runs().data());
    run.settle_noise(joint.theta(r));
  }
  refine_motion(joint, problem, windows, result);
  ParameterUncertainty uncertainty = estimate_uncertainty(joint);
  constexpr int rounds = 3;  // what was a line of the noise may turn out to be nothing at all once its damping is held
  for (int round = 0; round < rounds && hold_weak(joint, uncertainty, problem.start); ++round) {
    solve(joint, result);
    uncertainty = estimate_uncertainty(joint);
  }
  return uncertainty;
}

/// A name that no parameter has must not pass in silence.
void check_names(const AeroelasticModel& model, const FitProblem& problem) {
  std::string names;
  for (const Parameter& p : model.parameters()) names += (names.empty() ? "" : ", ") + p.name;
  const auto known = [&](const std::string& wanted) {
    return std::any_of(model.parameters().begin(), model.parameters().end(), [&](const Parameter& p) { return wanted == p.name || (p.per_run && wanted.starts_with(p.name + " (")); });
  };
  for (const auto& [name, value] : problem.start)
    if (!known(name)) throw InputError({"--start", 0}, "no parameter '" + name + "'", "wanted one of " + names, "");
  for (const std::string& name : problem.profile)
    if (name != "all" && !known(name)) throw InputError({"--profile", 0}, "no parameter '" + name + "' can be profiled", "wanted one of " + names, "Run files go before the option, or behind another one.");
}

/// The fit goes on with effects at work: from the best of each effect's starts, everything else where the fit without it ended.
JointProblem with_effects(const AeroelasticModel& model, const JointProblem& joint, const FitProblem& problem, const Windows& windows, FitResult& result) {
  JointProblem richer = make_joint(model, problem.runs, windows, 0);
  for (Unknown& u : richer.unknowns())
    for (const Unknown& known : joint.unknowns())
      if (u.parameter == known.parameter && u.run == known.run) u = known;
  for (std::size_t r = 0; r < richer.runs().size(); ++r) richer.runs()[r].keep_noise_of(joint.runs()[r]);
  for (const std::string& id : problem.effects) {
    tell(problem, "looking for " + id);
    const Effect& e = effect(id);
    std::vector<Unknown*> own;
    for (Unknown& u : richer.unknowns())
      if (richer.parameter(u).name.starts_with(id + ".")) own.push_back(&u);
    const auto set = [&](const VectorXd& values) {
      for (std::size_t k = 0; k < own.size(); ++k) own[k]->value = values[static_cast<Index>(k)];
    };
    VectorXd best(static_cast<Index>(own.size()));
    for (std::size_t k = 0; k < own.size(); ++k) best[static_cast<Index>(k)] = own[k]->value;
    double least = richer.chi2();
    for (const VectorXd& start : e.starts) {
      set(start);
      const double chi2 = richer.chi2();
      if (chi2 < least) {
        least = chi2;
        best = start;
      }
    }
    set(best);
  }
  hold_undetermined(richer);
  solve(richer, result, {});
  constexpr double explained = 1.3;
  const double reached = reduced_chi2(richer);
  if (reached < explained) return richer;

  // Without the effect the rig's parameters may have gone far astray: all over again, with the effect from the first sample on.
  std::map<std::string, double> starts = problem.start;
  for (const Unknown& u : richer.unknowns())
    if (const std::string& name = richer.parameter(u).name; std::any_of(problem.effects.begin(), problem.effects.end(), [&](const std::string& id) { return name.starts_with(id + "."); }))
      starts.emplace(name, richer.parameter(u).start);
  JointProblem other = arrive(model, problem, starts, windows, result);
  return reduced_chi2(other) < reached ? other : richer;
}

}  // namespace

double FitResult::bic() const { return chi2 + std::log(static_cast<double>(observations)) * static_cast<double>(variables); }

AeroelasticModel model_of(const Rig& rig, const std::vector<Run>& runs, Wagner circulation) {
  if (rig.is_modal()) return {rig, {}, wagner(circulation)};
  Basis basis;
  for (const Run& run : runs) {
    Basis wanted = make_basis(rig, 0.5 / run.dt, run.density);
    if (wanted.size() > basis.size()) basis = std::move(wanted);
  }
  return {rig, basis, wagner(circulation)};
}

FitResult fit(const FitProblem& problem) {
  const auto begin = std::chrono::steady_clock::now();
  FitResult result;
  result.rig_file = problem.rig.file;
  result.circulation = problem.circulation;
  result.warnings = problem.rig.warnings;
  const AeroelasticModel model = model_of(problem.rig, problem.runs, problem.circulation);
  result.normal_modes = model.basis().normal_modes;
  result.torsion_modes = model.basis().torsion_modes;

  Windows windows;
  for (const Run& run : problem.runs) {
    windows.push_back(problem.rig.is_modal() ? std::vector<MotionBasis::Window>{} : motion_windows(run));
    for (const std::string& warning : run.warnings) result.warnings.push_back(warning);
  }
  const AeroelasticModel complete = problem.effects.empty() ? model : model.with_effects(problem.effects);
  check_names(complete, problem);
  JointProblem joint = arrive(model, problem, problem.start, windows, result);
  hold_undetermined(joint);
  if (!problem.effects.empty()) joint = with_effects(complete, joint, problem, windows, result);
  result.effects = problem.effects;
  const ParameterUncertainty uncertainty = settle(joint, problem, windows, result);

  const JointProblem::Linearisation lin = joint.linearise();
  result.chi2 = lin.chi2();
  for (const Unknown& u : joint.unknowns()) result.variables += u.held ? 0 : 1;
  for (std::size_t r = 0; r < joint.runs().size(); ++r) {
    result.observations += joint.runs()[r].observations();
    result.variables += joint.runs()[r].linear_unknowns();
    result.runs.push_back(describe_run(joint.runs()[r], joint.theta(r), lin.run_chi2[r]));
  }
  describe_parameters(joint, uncertainty, problem.start, result);
  describe_profiles(joint, uncertainty, problem, result);
  warn_of_mismatch(result);
  result.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  return result;
}

}  // namespace unrig
