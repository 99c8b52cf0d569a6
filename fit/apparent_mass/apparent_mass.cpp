#include "fit/apparent_mass/apparent_mass.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <fmt/format.h>

#include "core/rig/fingerprint.h"
#include "core/files/text_file.h"
#include "fit/apparent_mass/rig_frequencies.h"

namespace unrig {
namespace {

using Eigen::Index;
using std::numbers::pi;

void tell(const ApparentMassProblem& problem, const std::string& what) {
  if (problem.progress) problem.progress(what);
}

void check_run(const Run& run, const char* which) {
  if (run.kind != RunKind::pluck)
    throw InputError({run.file, 0}, fmt::format("a run of kind \"{}\"", to_string(run.kind)), fmt::format("wanted a free decay (kind \"pluck\") as the {} run", which),
                     "Pluck the rig at rest and record how it dies away.");
  if (run.speed != 0)
    throw InputError({run.file, 0}, fmt::format("speed {:g} m/s", run.speed), "wanted still fluid (speed 0)",
                     "A stream adds stiffness and damping of its own; `unrig fit` takes such runs.");
}

void check(const ApparentMassProblem& problem) {
  check_run(problem.dry, "dry");
  check_run(problem.wet, "wet");
  if (problem.wet.density > problem.dry.density) return;
  throw InputError({problem.wet.file, 0}, fmt::format("density {:g} kg/m^3 in the wet run, {:g} kg/m^3 in the dry run {}", problem.wet.density, problem.dry.density, problem.dry.file),
                   "wanted the wet run in the denser fluid",
                   problem.wet.density < problem.dry.density ? "Exchange the files after --dry and --wet." : "Give a decay in air and one in the fluid.");
}

/// Of several poles the mean decay wanders, and its error says by how much, not that there might be none.
bool dies_away(const DampedMode& m) { return m.decay > (m.poles == 1 ? 2 * m.decay_error : 0); }

RunModes measure(const Run& run, const Rig& rig, const std::vector<std::string>& channels) {
  const DampedFrequencies found = damped_frequencies(run, channels);
  RunModes modes;
  modes.file = run.file;
  modes.fingerprint = fingerprint(run, rig);
  modes.medium = run.medium;
  modes.density = run.density;
  modes.hold = run.hold;
  modes.channels = channels;
  for (const std::string& channel : channels) modes.units.push_back(run.channel(channel).unit);
  modes.noise = found.noise;
  modes.residual = found.residual;
  for (const DampedMode& m : found.modes) {
    modes.modes.emplace_back();
    modes.modes.back().measured = m;
  }
  return modes;
}

/// How strong a vibration is over the whole record, in units of its noise.
double strength(const DampedMode& mode) { return std::sqrt(std::max(0.0, mode.significance)); }

/// Harmonics of the strongest vibration, where it does not decay exponentially: then it is not linear, and has some. They are counted upwards, each
/// giving the base more exactly than the one before; one whose neighbours below are missing is no harmonic.
void note_harmonics(RunModes& run) {
  const auto weaker = [](const ModeLine& a, const ModeLine& b) { return strength(a.measured) < strength(b.measured); };
  const DampedMode& first = std::max_element(run.modes.begin(), run.modes.end(), weaker)->measured;
  if (first.poles == 1) return;
  double base = first.frequency, error = first.frequency_error;
  int last = 1;
  for (ModeLine& line : run.modes) {
    const DampedMode& m = line.measured;
    const int order = static_cast<int>(std::lround(m.frequency / base));
    if (order < 2 || order > last + 2 || std::abs(m.frequency - order * base) > 2 * (order * error + m.frequency_error)) continue;
    line.note = fmt::format("harmonic {} of {:.4g} Hz", order, first.frequency);
    last = order;
    if (m.frequency_error / order < error) base = m.frequency / order, error = m.frequency_error / order;
  }
}

/// Writes into `note` why a vibration cannot be one of the rig's. The others may be.
void note_strangers(RunModes& run) {
  for (ModeLine& line : run.modes) {
    const DampedMode& m = line.measured;
    if (m.damping_ratio > 0.3) line.note = std::string("damped like a filter, not like a structure");
    if (!dies_away(m)) line.note = m.decay < -2 * m.decay_error ? std::string("grows") : std::string("does not die away: a tone");
  }
  note_harmonics(run);
}

/// A vibration of the rig that is stronger than what was taken for its lowest mode says that this was not it.
void demand_strongest(const RunModes& run) {
  for (const ModeLine& line : run.modes) {
    const DampedMode& m = line.measured;
    const bool stranger = line.note.find("tone") != std::string::npos || line.note.find("filter") != std::string::npos;
    if (line.mode > 0 || stranger || strength(m) <= strength(run.lowest())) continue;
    throw NoAnswer(fmt::format("{}: its strongest vibration, at {:.5g} Hz, is no mode of the rig at a stiffness that explains the others. Does the decay start with the release, "
                               "and is it linear (no freeplay, small swings)?",
                               run.file, m.frequency));
  }
}

void note_oddities(RunModes& run) {
  for (ModeLine& line : run.modes) {
    if (line.mode == 0 && line.note.empty()) line.note = std::string("no mode of the rig near it");
    if (line.mode > 0 && line.measured.poles > 1) line.note = std::string("does not decay exponentially");
  }
}

/// As many modes as can matter: ten normal ones and three torsional ones settle the lowest five coupled frequencies of the seed's rig in water to 1e-7.
UndampedSystem rich_system(const Rig& rig, double density) {
  constexpr Index normal = 10, torsional = 3;
  const Index normal_modes = std::min(normal, chain_modes(rig.normal).omega.size());
  const Index torsion_modes = std::min(torsional, chain_modes(rig.torsion).omega.size());
  return undamped_system(rig, make_basis(rig, normal_modes, torsion_modes), density);
}

ObservedRun observe(const Rig& rig, const Run& run, const RunModes& modes) {
  ObservedRun observed;
  observed.system = rich_system(rig, run.density);
  observed.sampling = 1 / run.dt;
  for (const ModeLine& line : modes.modes) {
    if (!line.note.empty()) continue;
    const DampedMode& m = line.measured;
    observed.observed.push_back({m.natural_frequency, m.natural_error, m.decay, strength(m), {}, 0});
  }
  return observed;
}

/// What the frequency fit found, back into the run's table.
void take_over(RunModes& run, const ObservedRun& observed, const RigScales& scales) {
  const NaturalFrequencies model = natural_frequencies(observed.system, scales);
  auto next = observed.observed.begin();
  for (std::size_t i = 0; i < run.modes.size(); ++i) {
    ModeLine& line = run.modes[i];
    if (!line.note.empty()) continue;
    const ObservedFrequency& f = *next++;
    if (!f.mode) continue;
    line.mode = static_cast<int>(*f.mode) + 1;
    line.model_frequency = std::sqrt(std::max(0.0, std::pow(model.hertz[*f.mode], 2) - std::pow(f.decay / (2 * pi), 2)));
    if (f.folded > 0) line.note = fmt::format("above the Nyquist frequency, folded down from {:.4g} Hz", line.model_frequency);
    if (line.mode == 1) run.fundamental = i;
  }
}

FittedParameter parameter(const char* name, double value, double std_error, double start) {
  FittedParameter p;
  p.name = name;
  p.unit = "1";
  p.value = value;
  p.std_error = std_error;
  p.start = start;
  return p;
}

void set_mass_ratio(ApparentMassResult& result) {
  const DampedMode &d = result.dry.lowest(), &w = result.wet.lowest();
  const double r2 = std::pow(d.natural_frequency / w.natural_frequency, 2);
  result.mass_ratio = {r2 - 1, 2 * r2 * std::hypot(d.natural_error / d.natural_frequency, w.natural_error / w.natural_frequency)};
}

void demand_significance(const ApparentMassResult& result, const Estimate& apparent) {
  constexpr double least = 3;
  const DampedMode &d = result.dry.lowest(), &w = result.wet.lowest();
  if (apparent.value > least * apparent.std_error && result.mass_ratio.value > least * result.mass_ratio.std_error) return;
  throw NoAnswer(fmt::format(
      "the frequency shift is not significant: {:.6g} +- {:.2g} Hz dry, {:.6g} +- {:.2g} Hz wet. Record longer or stronger decays, or use a denser fluid.",
      d.frequency, d.frequency_error, w.frequency, w.frequency_error));
}

void from_mode_shapes(const ApparentMassProblem& problem, ApparentMassResult& result) {
  const Rig& rig = problem.rig;
  ObservedRun dry = observe(rig, problem.dry, result.dry), wet = observe(rig, problem.wet, result.wet);
  const std::optional<FrequencyFit> fit = fit_rig_frequencies(dry, wet);
  if (!fit)
    throw NoAnswer(fmt::format("no stiffness of the rig {} puts its lowest mode on a measured frequency in both runs ({} and {}). "
                               "The lowest frequencies measured are {:.5g} Hz dry and {:.5g} Hz wet.",
                               rig.file, problem.dry.file, problem.wet.file, result.dry.modes.front().measured.frequency, result.wet.modes.front().measured.frequency));
  take_over(result.dry, dry, fit->scales);
  take_over(result.wet, wet, fit->scales);
  demand_strongest(result.dry);
  demand_strongest(result.wet);
  set_mass_ratio(result);

  const Eigen::Vector3d error = fit->covariance.diagonal().cwiseSqrt();
  const char* names[] = {"normal.stiffness_scale", "torsion.stiffness_scale", "apparent_mass_coefficient"};
  for (Index i = 0; i < 3; ++i) result.parameters.push_back(parameter(names[i], fit->scales[i], error[i], 1));
  if (!fit->torsion_identified) {
    result.parameters[1].identified = false;
    result.parameters[1].advice = "No torsional mode was heard; the rig file's ratio of the stiffnesses was used. Pluck the section off its pitch axis.";
  }
  result.reduced_chi2 = fit->reduced_chi2;
  result.degrees_of_freedom = fit->degrees_of_freedom;
  result.error_scale = fit->error_scale;

  const double theory = pi * problem.wet.density * rig.semichord() * rig.semichord();
  result.theory = theory;
  result.coefficient = Estimate{fit->scales[2], error[2]};
  result.mass = {theory * result.coefficient->value, theory * result.coefficient->std_error};
  result.mass_unit = "kg/m";

  RigScales vacuum = fit->scales;
  vacuum[2] = 0;
  const Eigen::VectorXd shape = natural_frequencies(dry.system, vacuum).shape.col(0);
  result.same_shape_coefficient = result.mass_ratio.value / shape.dot((wet.system.fluid_mass - dry.system.fluid_mass) * shape);
  demand_significance(result, *result.coefficient);
}

/// The rig's lowest mode in a run, where only its frequency in vacuum is known: the strongest vibration, or, where the rig has several modes, the
/// lowest that is not far weaker.
std::size_t lowest_modal(const RunModes& run, bool single) {
  double strongest = 0;
  for (const ModeLine& line : run.modes)
    if (line.note.empty()) strongest = std::max(strongest, strength(line.measured));
  const double enough = (single ? 1 : 0.1) * strongest;
  for (std::size_t i = 0; i < run.modes.size(); ++i)
    if (run.modes[i].note.empty() && strength(run.modes[i].measured) >= enough) return i;
  throw NoAnswer(fmt::format("{}: nothing in it decays like a vibration of the rig.", run.file));
}

void from_frequency_ratio(const ApparentMassProblem& problem, ApparentMassResult& result) {
  for (RunModes* run : {&result.dry, &result.wet}) {
    run->fundamental = lowest_modal(*run, problem.rig.modal.size() == 1);
    run->modes[run->fundamental].mode = 1;
  }
  set_mass_ratio(result);
  const double mass = problem.rig.modal.front().mass;
  result.mass = {mass * result.mass_ratio.value, mass * result.mass_ratio.std_error};
  result.mass_unit = "kg";
  demand_significance(result, result.mass);
}

const FittedParameter* find(const FitResult& fit, const std::string& name) {
  for (const FittedParameter& p : fit.parameters)
    if (p.name == name) return &p;
  return nullptr;
}

FitResult fit_runs(const ApparentMassProblem& problem, std::vector<Run> runs) {
  FitProblem whole;
  whole.rig = problem.rig;
  whole.runs = std::move(runs);
  whole.progress = problem.progress;
  return fit(whole);
}

/// The joint fit's value: C_a of the coupled model fitted to both decays; of a modal rig the mass that its stiffness per mass, fitted run by run, asks for.
ApparentMassResult::JointFit joint_fit(const ApparentMassProblem& problem) {
  ApparentMassResult::JointFit joint;
  try {
    if (!problem.rig.is_modal()) {
      const FitResult both = fit_runs(problem, {problem.dry, problem.wet});
      joint.converged = both.converged;
      joint.reduced_chi2 = both.reduced_chi2();
      if (!both.converged) joint.message = both.message;
      const FittedParameter* p = find(both, "apparent_mass_coefficient");
      if (p != nullptr && p->identified && both.converged) joint.value = Estimate{p->value, p->std_error};
      if (p != nullptr && !p->identified) joint.message = p->advice;
      return joint;
    }
    const FitResult dry = fit_runs(problem, {problem.dry});
    const FitResult wet = fit_runs(problem, {problem.wet});
    joint.converged = dry.converged && wet.converged;
    joint.reduced_chi2 = (dry.chi2 + wet.chi2) / static_cast<double>(dry.observations + wet.observations - dry.variables - wet.variables);
    const FittedParameter *d = find(dry, "modal[1].stiffness"), *w = find(wet, "modal[1].stiffness");
    if (!joint.converged || d == nullptr || w == nullptr) {
      joint.message = dry.converged ? wet.message : dry.message;
      return joint;
    }
    const double r2 = d->value / w->value, mass = problem.rig.modal.front().mass;
    joint.value = Estimate{mass * (r2 - 1), mass * r2 * std::hypot(d->std_error / d->value, w->std_error / w->value)};
  } catch (const NoAnswer& e) {
    joint.converged = false;
    joint.message = e.what();
  }
  return joint;
}

std::string sentence(ApparentMassResult::JointFit& fit, const Estimate& shift) {
  if (!fit.value) return fmt::format("The joint fit of both decays gives no value to compare with{}{}.", fit.message.empty() ? "" : ": ", fit.message);
  const double difference = fit.value->value - shift.value, sigmas = std::abs(difference) / std::hypot(shift.std_error, fit.value->std_error);
  const std::string apart = fmt::format("differs by {:+.2g} %, {:.2g} combined standard errors", 100 * difference / shift.value, sigmas);
  if (!(fit.reduced_chi2 < 2))
    return fmt::format("The joint fit of both decays confirms nothing: it leaves a reduced chi-square of {:.3g}, so that the recordings hold something that its model leaves out, and {}.", fit.reduced_chi2, apart);
  fit.agrees = sigmas <= 3;
  if (fit.agrees) return "The joint fit of both decays agrees: it " + apart + ".";
  return "The joint fit of both decays DISAGREES: it " + apart + ", although it describes the recordings: look for a rig file that is off.";
}

void add_warnings(ApparentMassResult& result) {
  for (const RunModes* run : {&result.dry, &result.wet}) {
    if (run->lowest().poles > 1)
      result.warnings.push_back(fmt::format("{}: the lowest mode does not decay exponentially (friction, drag, amplitude-dependent stiffness?); its frequency is that to which it "
                                            "tends as it dies",
                                            base_name(run->file)));
    for (std::size_t c = 0; c < run->channels.size(); ++c) {
      const auto i = static_cast<Index>(c);
      if (run->residual[i] > 1.5 * run->noise[i])
        result.warnings.push_back(fmt::format("{}: what the modes leave of '{}' is {:.1f} times its noise", base_name(run->file), run->channels[c], run->residual[i] / run->noise[i]));
    }
  }
  if (result.error_scale > 3)
    result.warnings.push_back(fmt::format("the rig's modes miss the measured frequencies by {:.0f} times their errors: the errors were enlarged by that factor; look for a rig file that is off", result.error_scale));
}

}  // namespace

ApparentMassResult apparent_mass(const ApparentMassProblem& problem) {
  check(problem);
  ApparentMassResult result;
  result.rig_file = problem.rig.file;
  result.rig_fingerprint = fingerprint(problem.rig);
  for (const auto* warnings : {&problem.rig.warnings, &problem.dry.warnings, &problem.wet.warnings})
    result.warnings.insert(result.warnings.end(), warnings->begin(), warnings->end());
  const AeroelasticModel model = model_of(problem.rig, {problem.dry, problem.wet}, Wagner::within_1e4);
  tell(problem, "measuring the dry frequencies");
  result.dry = measure(problem.dry, problem.rig, model.output_channels(problem.dry));
  tell(problem, "measuring the wet frequencies");
  result.wet = measure(problem.wet, problem.rig, model.output_channels(problem.wet));
  note_strangers(result.dry);
  note_strangers(result.wet);

  tell(problem, "matching the frequencies");
  result.method = problem.rig.is_modal() ? ApparentMassMethod::frequency_ratio : ApparentMassMethod::mode_shapes;
  if (problem.rig.is_modal())
    from_frequency_ratio(problem, result);
  else
    from_mode_shapes(problem, result);
  note_oddities(result.dry);
  note_oddities(result.wet);

  if (problem.joint_fit) result.joint_fit = joint_fit(problem);
  if (result.joint_fit) result.agreement = sentence(*result.joint_fit, result.coefficient ? *result.coefficient : result.mass);
  add_warnings(result);
  return result;
}

}  // namespace unrig
