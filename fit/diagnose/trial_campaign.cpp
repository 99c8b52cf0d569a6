#include "fit/diagnose/trial_campaign.h"

#include <algorithm>
#include <cmath>

#include "core/effects/effect.h"
#include "core/error.h"
#include "core/simulate.h"

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::VectorXd;
using Random = std::mt19937_64;
using Strings = std::vector<std::string>;

/// From far below what the noise lets one see to what nobody overlooks; parameter by parameter, evenly in the logarithm.
struct Range {
  double low, high;
};
struct Ranges {
  const char* effect;
  std::vector<Range> parameters;
};
const std::vector<Ranges> ranges{
    {"quadratic-drag", {{0.3, 20}}},       {"wagner-lag", {{0.25, 0.9}, {1, 1}}},       {"separation-lag", {{0.01, 0.4}, {4, 40}}}, {"vortex-shedding", {{0.12, 0.25}}},
    {"tank-wave", {{0.2, 1.5}, {3, 15}}},  {"carriage-vibration", {{3, 40}}},           {"gauge-lowpass", {{4, 150}, {0.7, 0.7}}},  {"torsion-crosstalk", {{0.05, 10}}},
    {"gauge-drift", {{3, 40}}},            {"mains-hum", {{49.8, 50.2}}},               {"channel-delay", {{5e-4, 0.03}}},          {"freeplay", {{3e-5, 3e-3}}},
};
constexpr Range signal_size{0.2, 20};  // r.m.s. in the run that it disturbs most, over the noise

/// Friction and the cubic spring are measured by what releases the pluck.
VectorXd draw_parameters(const Effect& e, const AeroelasticModel& model, double release, Random& random) {
  VectorXd p(static_cast<Index>(e.parameters.size()));
  for (Index k = 0; k < p.size(); ++k) p[k] = e.parameters[static_cast<std::size_t>(k)].start;
  const double angular = model.basis().omega[0], stiffness = first_mode_momentum(model) * angular, deflection = release / stiffness;
  if (e.id == "coulomb-friction") p << log_between(random, 1e-3, 0.1) * release, 0.01 * deflection * angular;
  if (e.id == "cubic-stiffness") p[0] = log_between(random, 1e-3, 0.5) * stiffness / (deflection * deflection);
  for (const Ranges& r : ranges)
    if (e.id == r.effect)
      for (std::size_t k = 0; k < r.parameters.size(); ++k) p[static_cast<Index>(k)] = log_between(random, r.parameters[k].low, r.parameters[k].high);
  return p;
}

VectorXd draw_rig(const AeroelasticModel& model, Random& random) {
  VectorXd theta = model.start_values();
  const auto set = [&](const char* name, double low, double high) { theta[model.index(name)] = log_between(random, low, high); };
  set("normal.stiffness_scale", 0.7, 1.1);
  set("torsion.stiffness_scale", 0.7, 1.1);
  set("normal.damping_ratio", 0.005, 0.015);
  set("torsion.damping_ratio", 0.01, 0.03);
  set("apparent_mass_coefficient", 0.9, 1.2);
  return theta;
}

/// What drives the same rig in one run, with and without what is hidden.
SimulateProblem problem_of(const AeroelasticModel& model, const VectorXd& theta, const PlannedRun& planned) {
  SimulateProblem problem{model, theta, planned.fine, {}, {}, {}};
  problem.theta[model.index("normal_force_slope")] = planned.slope;
  if (planned.release > 0) problem.release_load = planned.release;
  else problem.steady_normal_force = planned.steady;
  return problem;
}

VectorXd gauge(const SimulateProblem& problem) { return simulate(problem).run.channel("gauge").value; }
double rms(const VectorXd& x) { return std::sqrt(x.squaredNorm() / static_cast<double>(x.size())); }

VectorXd white_noise(Index samples, Random& random) {
  std::normal_distribution<double> normal;
  return VectorXd::NullaryExpr(samples, [&] { return normal(random); });
}

/// The rig with one of the hidden effects at work, and what it is told from.
struct Alone {
  AeroelasticModel known, with;
  VectorXd theta;  // of `with`; it begins with that of `known`
};

Alone beside_the_rig(const std::string& id, const AeroelasticModel& known, const AeroelasticModel& bare, const AeroelasticModel& all, const VectorXd& theta) {
  Alone alone{known, bare.with_effects({id}), {}};
  alone.theta = alone.with.start_values();
  for (Index k = 0; k < alone.theta.size(); ++k) alone.theta[k] = theta[all.index(alone.with.parameters()[static_cast<std::size_t>(k)].name)];
  return alone;
}

/// Initial values of the signals of the k-th hidden effect, of those of all.
VectorXd own_signals(const Strings& hidden, std::size_t k, const AeroelasticModel& bare, const SimulateProblem& of_all) {
  Index first = 0;
  for (std::size_t i = 0;; ++i) {
    const AeroelasticModel one = bare.with_effects({hidden[i]});
    const auto count = static_cast<Index>(one.system(conditions_of(of_all.run), one.start_values(), {"gauge"}).exogenous.size());
    if (i == k) return of_all.signals.segment(first, count);
    first += count;
  }
}

/// What it does to the gauge in one run, r.m.s.
double trace_of(const Alone& effect, const PlannedRun& planned, const VectorXd& signals) {
  SimulateProblem problem = problem_of(effect.with, effect.theta, planned);
  problem.signals = signals;
  const VectorXd theta = effect.theta.head(effect.known.start_values().size());
  return rms(gauge(problem) - gauge(problem_of(effect.known, theta, planned)));
}

/// Every mode that half the simulated sampling rate lets through, in the densest fluid, circulation within 1e-6.
AeroelasticModel whole_model(const Rig& rig, const std::vector<PlannedRun>& runs) {
  double nyquist = 0, density = 0;
  for (const PlannedRun& run : runs) {
    nyquist = std::max(nyquist, 0.5 / run.fine.dt);
    density = std::max(density, run.fine.density);
  }
  return {rig, make_basis(rig, nyquist, density), wagner(Wagner::within_1e6)};
}

double first_release(const std::vector<PlannedRun>& runs) {
  constexpr double usual = 20;
  const auto pluck = std::find_if(runs.begin(), runs.end(), [](const PlannedRun& run) { return run.release > 0; });
  return pluck == runs.end() ? usual : pluck->release;
}

/// Amplitudes of the signals, alike in all runs, such that the run that they disturb most is disturbed by what `signal_size` says.
void draw_signals(const std::vector<PlannedRun>& runs, std::vector<SimulateProblem>& problems, Random& random) {
  double disturbed = 0;
  for (std::size_t r = 0; r < runs.size(); ++r) {
    SimulateProblem& problem = problems[r];
    const auto signals = static_cast<Index>(problem.model.system(conditions_of(problem.run), problem.theta, {"gauge"}).exogenous.size());
    problem.signals = VectorXd::Zero(signals);
    if (signals == 0) continue;
    const VectorXd quiet = gauge(problem);
    problem.signals = white_noise(signals, random);
    disturbed = std::max(disturbed, rms(gauge(problem) - quiet) / runs[r].noise);
  }
  if (!(disturbed > 0)) return;
  const double wanted = log_between(random, signal_size.low, signal_size.high);
  for (SimulateProblem& problem : problems) problem.signals *= wanted / disturbed;
}

/// With noise, and whatever else the readings have.
Run recorded(const Run& fine, const PlannedRun& planned, Random& random) {
  Run run = every_nth(fine, PlannedRun::finer);
  std::erase_if(run.channels, [](const Channel& c) { return c.name != "alpha" && c.name != "gauge"; });
  for (Channel& c : run.channels) {
    c.value += (c.name == "alpha" ? planned.angle_noise : planned.noise) * white_noise(c.value.size(), random);
    if (const Channel* beside = planned.disturbed.find(c.name)) c.value += beside->value;
  }
  return run;
}

}  // namespace

void check_for_trials(const Rig& rig) {
  if (rig.is_modal() || rig.gauge_element == 0 || rig.calibration_element == 0 || rig.submerged.empty())
    throw InputError({rig.file, 0}, "the rig cannot be plucked and pitched", "wanted a beam rig with a gauge, a calibration element and a submerged section", "");
}

TrialCampaign draw_campaign(const Rig& rig, const Strings& hidden, const std::vector<PlannedRun>& runs, Random& random) {
  check_for_trials(rig);
  TrialCampaign campaign;
  campaign.hidden = hidden;
  campaign.rig = rig;
  campaign.rig.normal.modes = 0;
  const Rig whole = campaign.rig;
  const AeroelasticModel bare = whole_model(whole, runs), model = bare.with_effects(hidden);
  // Of hidden modes the trace is what the truth has beside a rig of one.
  const AeroelasticModel one_mode(whole, make_basis(whole, Index{1}, bare.basis().torsion_modes), bare.circulation());
  const bool modes_hidden = std::find(hidden.begin(), hidden.end(), "higher-mode") != hidden.end();
  if (modes_hidden) campaign.rig.normal.modes = 1;

  const VectorXd rig_theta = draw_rig(bare, random);
  VectorXd theta = model.start_values();
  theta.head(rig_theta.size()) = rig_theta;
  for (const std::string& id : hidden) {
    const VectorXd p = draw_parameters(effect(id), bare, first_release(runs), random);
    theta.segment(rig_theta.size() + static_cast<Index>(campaign.parameters.size()), p.size()) = p;
    campaign.parameters.insert(campaign.parameters.end(), p.begin(), p.end());
  }
  std::vector<SimulateProblem> problems;
  for (const PlannedRun& planned : runs) problems.push_back(problem_of(model, theta, planned));
  draw_signals(runs, problems, random);
  for (std::size_t r = 0; r < runs.size(); ++r) {
    const Run fine = simulate(problems[r]).run;
    if (!hidden.empty()) campaign.size = std::max(campaign.size, rms(fine.channel("gauge").value - gauge(problem_of(modes_hidden ? one_mode : bare, rig_theta, runs[r]))) / runs[r].noise);
    campaign.runs.push_back(recorded(fine, runs[r], random));
  }
  campaign.sizes.assign(hidden.size(), 0);
  for (std::size_t k = 0; k < hidden.size(); ++k) {
    const Alone alone = beside_the_rig(hidden[k], hidden[k] == "higher-mode" ? one_mode : bare, bare, model, theta);
    for (std::size_t r = 0; r < runs.size(); ++r) campaign.sizes[k] = std::max(campaign.sizes[k], trace_of(alone, runs[r], own_signals(hidden, k, bare, problems[r])) / runs[r].noise);
  }
  return campaign;
}

}  // namespace unrig
