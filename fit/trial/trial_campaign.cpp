#include "fit/trial/trial_campaign.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "core/effects/effect.h"
#include "core/files/error.h"
#include "core/law/law_effect.h"
#include "core/model/simulate.h"
#include "core/propagate/exact_step.h"

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using Random = std::mt19937_64;
using Strings = std::vector<std::string>;

constexpr Effect::Band signal_size{0.2, 20};  // r.m.s. in the run that it disturbs most, over the noise

VectorXd draw_parameters(const Effect& e, const AeroelasticModel& model, double release, Random& random) {
  if (e.draw) return e.draw(model, release, random);
  VectorXd p(static_cast<Index>(e.parameters.size()));
  for (Index k = 0; k < p.size(); ++k) p[k] = e.parameters[static_cast<std::size_t>(k)].start;
  return p;
}

double rms(const VectorXd& x) { return std::sqrt(x.squaredNorm() / static_cast<double>(x.size())); }

/// Columns that a diagnosis is given: the angle, the gauge, and every sensor.
bool is_recorded(const Channel& channel, const Rig& rig) {
  return channel.name == "alpha" || channel.name == "gauge" || std::any_of(rig.sensors.begin(), rig.sensors.end(), [&](const Sensor& s) { return s.column == channel.name; });
}

/// Noise of a channel: a sensor is as good as the gauge, in proportion to what both read.
double noise_of(const Channel& channel, const Run& run, const PlannedRun& planned) {
  if (channel.name == "alpha") return planned.angle_noise;
  const auto swing = [](const VectorXd& x) { return rms(x.array() - x.mean()); };
  return channel.name == "gauge" ? planned.noise : planned.noise * swing(channel.value) / swing(run.channel("gauge").value);
}

/// How far two runs are apart in what is read of the rig: the largest r.m.s. of a channel, over its noise.
double apart(const Run& with, const Run& without, const Rig& rig, const PlannedRun& planned) {
  double most = 0;
  for (const Channel& c : with.channels)
    if (c.name != "alpha" && is_recorded(c, rig)) most = std::max(most, rms(c.value - without.channel(c.name).value) / noise_of(c, with, planned));
  return most;
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

/// What it does to one run.
double trace_of(const Alone& effect, const PlannedRun& planned, const VectorXd& signals) {
  SimulateProblem problem = problem_of(effect.with, effect.theta, planned);
  problem.signals = signals;
  const VectorXd theta = effect.theta.head(effect.known.start_values().size());
  return apart(simulate(problem).run, simulate(problem_of(effect.known, theta, planned)).run, effect.known.rig(), planned);
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
    const Run quiet = simulate(problem).run;
    problem.signals = white_noise(signals, random);
    disturbed = std::max(disturbed, apart(simulate(problem).run, quiet, problem.model.rig(), runs[r]));
  }
  if (!(disturbed > 0)) return;
  const double wanted = log_between(random, signal_size.first, signal_size.second);
  for (SimulateProblem& problem : problems) problem.signals *= wanted / disturbed;
}

/// Signals whose phase walks: what they change by behind each sample to stay on the circle on which they begin, the two states of each hidden effect whose signals wander.
MatrixXd walking_phases(const Strings& hidden, const AeroelasticModel& bare, const SimulateProblem& problem, double walk, Random& random) {
  const LinearSystem system = problem.model.system(conditions_of(problem.run), problem.theta, {"gauge"});
  const ExactStep step = exact_step(system, problem.run.dt);
  MatrixXd steps;
  Index first = 0;
  for (const std::string& id : hidden) {
    const AeroelasticModel one = bare.with_effects({id});
    const auto count = static_cast<Index>(one.system(conditions_of(problem.run), one.start_values(), {"gauge"}).exogenous.size());
    if (effect(bare.rig(), id).noise && count == 2) {
      if (steps.size() == 0) steps = MatrixXd::Zero(problem.run.samples(), static_cast<Index>(system.exogenous.size()));
      const std::vector<Index> own{system.exogenous[static_cast<std::size_t>(first)], system.exogenous[static_cast<std::size_t>(first) + 1]};
      const Eigen::Matrix2d on = step.transition.value(own, own);
      Eigen::Vector2d z = problem.signals.segment(first, 2);
      const VectorXd turns = walk * std::sqrt(problem.run.dt) * white_noise(problem.run.samples(), random);
      for (Index k = 0; k < turns.size(); ++k) {
        const Eigen::Vector2d after = on * z;
        z = Eigen::Rotation2Dd(turns[k]) * after;
        steps.block(k, first, 1, 2) = (z - after).transpose();
      }
    }
    first += count;
  }
  return steps;
}

/// What a converter with steps of this size makes of it.
VectorXd rounded(const VectorXd& reading, double size) { return size * (reading / size).array().round(); }

/// With noise, and whatever else the readings have.
Run recorded(const Run& fine, const PlannedRun& planned, const Rig& rig, const Laboratory& laboratory, Random& random) {
  Run run = every_nth(fine, PlannedRun::finer);
  std::erase_if(run.channels, [&](const Channel& c) { return !is_recorded(c, rig); });
  for (Channel& c : run.channels) {
    const double noise = noise_of(c, fine, planned);
    c.value += noise * (c.name == "gauge" ? draw_noise(laboratory, c.value.size(), run.dt, random) : white_noise(c.value.size(), random));
    if (c.name == "gauge" && laboratory.converter > 0) c.value = rounded(c.value, laboratory.converter * noise);
    if (const Channel* beside = planned.disturbed.find(c.name)) c.value += beside->value;
  }
  return run;
}

}  // namespace

AeroelasticModel whole_model(const Rig& rig, const std::vector<PlannedRun>& runs) {
  double nyquist = 0, density = 0;
  for (const PlannedRun& run : runs) {
    nyquist = std::max(nyquist, 0.5 / run.fine.dt);
    density = std::max(density, run.fine.density);
  }
  return {rig, make_basis(rig, nyquist, density), wagner(Wagner::within_1e6)};
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

SimulateProblem problem_of(const AeroelasticModel& model, const VectorXd& theta, const PlannedRun& planned) {
  SimulateProblem problem{model, theta, planned.fine, {}, {}, {}};
  problem.theta[model.index("normal_force_slope")] = planned.slope;
  if (planned.release > 0) problem.release_load = planned.release;
  else problem.steady_normal_force = planned.steady;
  return problem;
}

void check_for_trials(const Rig& rig) {
  if (rig.gauge_element == 0 || rig.submerged.empty())
    throw InputError({rig.file, 0}, "the rig cannot be plucked and pitched", "wanted a beam rig with a gauge, a calibration element and a submerged section", "");
}

TrialCampaign draw_campaign(const Rig& rig, const Strings& hidden, const std::vector<PlannedRun>& runs, const Laboratory& laboratory, Random& random, const std::optional<VectorXd>& truth) {
  check_for_trials(rig);
  TrialCampaign campaign;
  campaign.hidden = hidden;
  campaign.rig = rig;
  campaign.rig.normal.modes = 0;
  const Rig whole = campaign.rig;
  const AeroelasticModel bare = whole_model(whole, runs), model = bare.with_effects(hidden);
  // Of hidden modes the trace is what the truth has beside a rig of one.
  const AeroelasticModel one_mode(whole, make_basis(whole, Index{1}, bare.basis().torsion_modes), bare.circulation());
  const bool modes_hidden = std::any_of(hidden.begin(), hidden.end(), [&](const std::string& id) { return effect(rig, id).enriches_basis; });
  if (modes_hidden) campaign.rig.normal.modes = 1;

  const VectorXd rig_theta = truth ? *truth : draw_rig(bare, random);
  VectorXd theta = model.start_values();
  theta.head(rig_theta.size()) = rig_theta;
  for (const std::string& id : hidden) {
    const VectorXd p = draw_parameters(effect(rig, id), bare, first_release(runs), random);
    theta.segment(rig_theta.size() + static_cast<Index>(campaign.parameters.size()), p.size()) = p;
    campaign.parameters.insert(campaign.parameters.end(), p.begin(), p.end());
  }
  for (Index k = 0; k < theta.size(); ++k)
    if (const Parameter& p = model.parameters()[static_cast<std::size_t>(k)]; !p.per_run) campaign.truth[p.name] = theta[k];
  std::vector<SimulateProblem> problems;
  for (const PlannedRun& planned : runs) problems.push_back(problem_of(model, theta, planned));
  draw_signals(runs, problems, random);
  if (laboratory.phase_walk > 0)
    for (SimulateProblem& problem : problems) problem.signal_steps = walking_phases(hidden, bare, problem, laboratory.phase_walk, random);
  for (std::size_t r = 0; r < runs.size(); ++r) {
    const Run fine = simulate(problems[r]).run;
    if (!hidden.empty()) campaign.size = std::max(campaign.size, apart(fine, simulate(problem_of(modes_hidden ? one_mode : bare, rig_theta, runs[r])).run, rig, runs[r]));
    campaign.runs.push_back(recorded(fine, runs[r], rig, laboratory, random));
  }
  campaign.sizes.assign(hidden.size(), 0);
  for (std::size_t k = 0; k < hidden.size(); ++k) {
    const Alone alone = beside_the_rig(hidden[k], effect(rig, hidden[k]).enriches_basis ? one_mode : bare, bare, model, theta);
    for (std::size_t r = 0; r < runs.size(); ++r) campaign.sizes[k] = std::max(campaign.sizes[k], trace_of(alone, runs[r], own_signals(hidden, k, bare, problems[r])));
  }
  misread(laboratory, campaign.rig, campaign.runs, random);
  return campaign;
}

}  // namespace unrig
