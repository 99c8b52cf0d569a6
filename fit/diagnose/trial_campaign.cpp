#include "fit/diagnose/trial_campaign.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/effects/effect.h"
#include "core/error.h"
#include "core/simulate.h"

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::VectorXd;
using std::numbers::pi;
using Random = std::mt19937_64;

constexpr double dt = 0.002, pluck_seconds = 5, step_seconds = 6, angle_noise = 0.01 * pi / 180;
constexpr Index finer = 4;

double between(Random& random, double low, double high) { return std::uniform_real_distribution<double>(low, high)(random); }
double log_between(Random& random, double low, double high) { return std::exp(between(random, std::log(low), std::log(high))); }

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

void put(Run& run, const std::string& name, const std::string& unit, const VectorXd& value) { run.channels.push_back({name, unit, unit, 1, value, 0}); }

struct Planned {
  Run fine;
  double release = 0, slope = 0, steady = 0;
};

Run bare_run(const std::string& name, RunKind kind, double density, double speed, double seconds) {
  Run run;
  run.file = name + ".csv";
  run.name = name;
  run.kind = kind;
  run.medium = density > 100 ? "water" : "air";
  run.density = density;
  run.speed = speed;
  run.dt = dt / finer;
  put(run, "alpha", "rad", VectorXd::Zero(finer * static_cast<Index>(std::lround(seconds / dt))));
  return run;
}

Planned step_run(const std::string& name, double speed, double onset, double step, double slope, double steady, Random& random) {
  Planned p{bare_run(name, RunKind::step, 998.2, speed, step_seconds), 0, slope, steady};
  const double begin = 1, ramp = log_between(random, 0.06, 0.12);
  VectorXd& alpha = p.fine.channels.front().value;
  for (Index k = 0; k < alpha.size(); ++k) alpha[k] = (onset + step * smooth_ramp((p.fine.time(k) - begin) / ramp)) * pi / 180;
  return p;
}

std::vector<Planned> plan(Random& random) {
  const double speed = log_between(random, 0.5, 0.7), slope = between(random, 5, 2 * pi), degree = pi / 180;
  std::vector<Planned> runs;
  for (const double density : {1.2, 998.2})
    runs.push_back({bare_run(density > 100 ? "wet_pluck" : "dry_pluck", RunKind::pluck, density, 0, pluck_seconds), log_between(random, 15, 30), slope, 0});
  runs.push_back(step_run("step_a", speed, 2, 1.3, slope, slope * 2 * degree, random));
  runs.push_back(step_run("step_b", 0.8 * speed, 4, 2.5, slope, slope * 4 * degree, random));
  runs.push_back(step_run("step_c", speed, 25, 1.5, between(random, 0.5, 0.7) * slope, between(random, 0.8, 1.0), random));
  return runs;
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
SimulateProblem problem_of(const AeroelasticModel& model, const VectorXd& theta, const Planned& planned) {
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

/// What it does to the gauge in one run, r.m.s.; its signals begin at `first` of `signals`, which moves on to the next effect's.
double trace_of(const Alone& effect, const Planned& planned, const VectorXd& signals, Index& first) {
  SimulateProblem problem = problem_of(effect.with, effect.theta, planned);
  const auto own = static_cast<Index>(effect.with.system(conditions_of(problem.run), problem.theta, {"gauge"}).exogenous.size());
  problem.signals = signals.segment(first, own);
  first += own;
  const VectorXd theta = effect.theta.head(effect.known.start_values().size());
  return rms(gauge(problem) - gauge(problem_of(effect.known, theta, planned)));
}

}  // namespace

void check_for_trials(const Rig& rig) {
  if (rig.is_modal() || rig.gauge_element == 0 || rig.calibration_element == 0 || rig.submerged.empty())
    throw InputError({rig.file, 0}, "the rig cannot be plucked and pitched", "wanted a beam rig with a gauge, a calibration element and a submerged section", "");
}

double smooth_ramp(double x) {
  if (x <= 0) return 0;
  if (x >= 1) return 1;
  return x * x * x * x * (35 + x * (-84 + x * (70 - 20 * x)));
}

Run every_nth(const Run& fine, Index n) {
  Run run = fine;
  run.dt = fine.dt * static_cast<double>(n);
  for (Channel& c : run.channels) {
    const Index samples = (c.value.size() + n - 1) / n;
    VectorXd kept(samples);
    for (Index k = 0; k < samples; ++k) kept[k] = c.value[n * k];
    c.value = kept;
  }
  return run;
}

TrialCampaign draw_campaign(const Rig& rig, const std::vector<std::string>& hidden, double noise, Random& random) {
  check_for_trials(rig);
  TrialCampaign campaign;
  campaign.hidden = hidden;
  campaign.sizes.assign(hidden.size(), 0);
  campaign.rig = rig;
  campaign.rig.normal.modes = 0;
  const Rig whole = campaign.rig;
  const AeroelasticModel bare(whole, make_basis(whole, 0.5 * finer / dt, 998.2), wagner(Wagner::within_1e6)), model = bare.with_effects(hidden);
  // Of hidden modes the trace is what the truth has beside a rig of one.
  const bool modes_hidden = std::find(hidden.begin(), hidden.end(), "higher-mode") != hidden.end();
  if (modes_hidden) campaign.rig.normal.modes = 1;
  const AeroelasticModel one_mode(whole, make_basis(whole, Index{1}, bare.basis().torsion_modes), bare.circulation()), &known = modes_hidden ? one_mode : bare;

  const std::vector<Planned> runs = plan(random);
  const VectorXd rig_theta = draw_rig(bare, random);
  VectorXd theta = model.start_values();
  theta.head(rig_theta.size()) = rig_theta;
  Index first = rig_theta.size();
  for (const std::string& id : hidden) {
    const VectorXd p = draw_parameters(effect(id), bare, runs.front().release, random);
    theta.segment(first, p.size()) = p;
    campaign.parameters.insert(campaign.parameters.end(), p.begin(), p.end());
    first += p.size();
  }

  std::vector<Alone> alone;
  for (const std::string& id : hidden) alone.push_back(beside_the_rig(id, id == "higher-mode" ? one_mode : bare, bare, model, theta));

  std::vector<SimulateProblem> problems;
  std::vector<VectorXd> without;
  double disturbed = 0;
  bool signals = false;
  for (const Planned& planned : runs) {
    SimulateProblem problem = problem_of(model, theta, planned);
    const LinearSystem system = model.system(conditions_of(problem.run), problem.theta, {"gauge"});
    if (!hidden.empty()) without.push_back(gauge(problem_of(known, rig_theta, planned)));
    if (!system.exogenous.empty()) {
      const VectorXd quiet = gauge(problem);
      problem.signals = white_noise(static_cast<Index>(system.exogenous.size()), random);
      disturbed = std::max(disturbed, rms(gauge(problem) - quiet));
      signals = true;
    }
    problems.push_back(problem);
  }
  if (signals) {
    const double wanted = log_between(random, signal_size.low, signal_size.high) * noise;
    for (SimulateProblem& problem : problems) problem.signals *= wanted / disturbed;
  }
  for (std::size_t r = 0; r < problems.size(); ++r) {
    Run fine = simulate(problems[r]).run;
    if (!hidden.empty()) campaign.size = std::max(campaign.size, rms(fine.channel("gauge").value - without[r]) / noise);
    Index first_signal = 0;
    for (std::size_t k = 0; k < alone.size(); ++k) campaign.sizes[k] = std::max(campaign.sizes[k], trace_of(alone[k], runs[r], problems[r].signals, first_signal) / noise);
    std::erase_if(fine.channels, [](const Channel& c) { return c.name != "alpha" && c.name != "gauge"; });
    Run recorded = every_nth(fine, finer);
    for (Channel& c : recorded.channels) c.value += (c.name == "alpha" ? angle_noise : noise) * white_noise(c.value.size(), random);
    campaign.runs.push_back(std::move(recorded));
  }
  return campaign;
}

}  // namespace unrig
