#include "fit/simulate/simulate_command.h"
#include "fit/simulate/simulate_problem.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <complex>
#include <filesystem>
#include <numbers>
#include <optional>

#include "core/files/command.h"
#include "core/files/command_line.h"
#include "core/rig/fingerprint.h"
#include "core/rig/given_files.h"
#include "core/model/indicial_table.h"
#include "core/law/law_effect.h"
#include "core/law/learnt_range.h"
#include "core/files/provenance.h"
#include "core/run/run_text.h"
#include "core/files/scan.h"
#include "core/model/simulate.h"
#include "core/files/text_file.h"
#include "core/files/units.h"
#include "fit/fit_files.h"
#include "fit/givens/fitted_numbers.h"
#include "fit/likelihood/shaft_motion.h"
#include "fit/simulate/simulated_run.h"

namespace unrig {
namespace {

using Eigen::Index;

constexpr const char* steady_name = "steady_normal_force";

using Options = SimulateOptions;

IndicialFunction circulation_of(const Options& options, const std::optional<FittedRig>& fit, const std::optional<TabulatedIndicial>& table) {
  if (table && !options.circulation.empty()) throw InputError({"--wagner", 0}, "both --indicial and --wagner", "wanted one of them", "");
  if (table) return table->function;
  if (options.circulation.empty()) return wagner(fit ? fit->circulation : Wagner::within_1e4);
  try {
    return wagner(wagner_from_name(options.circulation));
  } catch (const std::invalid_argument& e) {
    throw InputError({"--wagner", 0}, e.what(), "wanted one of the names above", "");
  }
}

/// The rig file's modes; a fit's where there is one; what the command line asks for above all.
Basis basis_of(const Rig& rig, const Run& run, const std::optional<FittedRig>& fit, const Options& options) {
  if (rig.is_modal()) {
    if (options.normal_modes + options.torsion_modes > 0 || !options.circulation.empty() || !options.indicial.empty())
      throw InputError({rig.file, 0}, "the rig is known only as modes", "wanted no --modes, --torsion-modes, --wagner or --indicial for it", "");
    return {};
  }
  const Basis asked = make_basis(rig, 0.5 / run.dt, run.density);
  const auto choose = [](Index command_line, Index fitted, Index file) {
    return command_line > 0 ? command_line : fitted > 0 ? fitted : file;
  };
  try {
    return make_basis(rig, choose(options.normal_modes, fit ? fit->normal_modes : 0, asked.normal_modes),
                      choose(options.torsion_modes, fit ? fit->torsion_modes : 0, asked.torsion_modes));
  } catch (const std::invalid_argument& e) {
    throw InputError({rig.file, 0}, e.what(), "wanted no more modes than the rig has", "");
  }
}

/// `name=value` into theta, or into the steady load, which is no parameter of the motion.
void set(const std::string& setting, SimulateProblem& problem) {
  const InputError::Place place{"--set", 0};
  const std::size_t equals = setting.find('=');
  const std::string name = setting.substr(0, equals);
  std::string names = steady_name;
  Index found = -1;
  for (std::size_t j = 0; j < problem.model.parameters().size(); ++j) {
    if (problem.model.parameters()[j].name == name) found = static_cast<Index>(j);
    names += ", " + problem.model.parameters()[j].name;
  }
  double value = 0;
  const char* first = equals == std::string::npos ? nullptr : setting.data() + equals + 1;
  const char* last = setting.data() + setting.size();
  if (!first || first == last || read_number(first, last, value) != last || !std::isfinite(value))
    throw InputError(place, fmt::format("\"{}\" sets nothing", setting), "wanted name=value with a finite number", "");
  if (name == steady_name)
    problem.steady_normal_force = value;
  else if (found >= 0)
    problem.theta[found] = value;
  else
    throw InputError(place, fmt::format("no parameter is called \"{}\"", name), "wanted one of: " + names, "");
}

/// The rig with the fit's laws and those of the command line; the effects at work.
std::vector<std::string> put_laws(Rig& rig, const std::optional<FittedRig>& fit, const std::vector<std::string>& paths) {
  std::vector<std::string> effects;
  if (fit) {
    effects = fit->effects;
    rig = with_laws(std::move(rig), *fit);
  }
  for (const std::string& path : paths) {
    const Law law = read_law(path);
    const auto fitted = fit ? std::find_if(fit->laws.begin(), fit->laws.end(), [&](const auto& other) { return other->id == law.id(); }) : std::vector<std::shared_ptr<const Effect>>::const_iterator{};
    if (fit && fitted != fit->laws.end()) {
      if (!law.says_the_same_as(law_of(**fitted)))
        throw InputError({path, 0}, fmt::format("the law \"{}\" is another than the one of this name in {}, {}", law.name, fit->file, (*fitted)->equation), "wanted the law that was fitted", "Leave --law out, since the fit carries its laws, or fit again.");
      continue;
    }
    if (fit) warn(fmt::format("{}: the law \"{}\" had no part in {}; it acts with the start values of its file", path, law.name, fit->file));
    add_law(rig, law);
    effects.push_back(law.id());
  }
  return effects;
}

/// A measured angle is replaced by the motion that it says.
void take_out_noise_of_the_angle(const Rig& rig, Run& run) {
  const std::optional<ShaftMotion> motion = shaft_motion(rig, run);
  if (!motion) return;
  for (Channel& channel : run.channels)
    if (channel.name == "alpha") channel.value = motion->angle;
  constexpr double degree = std::numbers::pi / 180;
  warn(fmt::format("{}: the angle is a measurement, with a noise of {:.2g} deg; simulated is the smooth motion that it says (--as-recorded: every reading as it is)", run.file, motion->noise / degree));
}

}  // namespace

ToSimulate simulate_problem(Rig rig, Run run, const std::optional<FittedRig>& fit, const SimulateOptions& options, const Provenance& made) {
  if (fit)
    if (const std::string found = other_rig(rig, *fit); !found.empty())
      warn(rig.file + ": " + found + "; simulated is this rig with the fit's parameters, which multiply its numbers.");
  if (fit && fit->had_other_readings(run, rig))
    warn(fmt::format("{}: other readings or conditions than those that {} was fitted to; it is simulated with the slope and the steady load of the fitted ones all the same. Fit again, or give the new recording "
                     "another name.",
                     run.file, fit->file));
  const MadeBy made_by{made, fingerprint(rig), fingerprint(run, rig), fit ? fingerprint(*fit) : ""};
  if (fit && !fit->givens.empty()) {
    const FittedNumbers numbers(*fit, rig, run);
    const Rig fitted_rig = numbers.rig();
    const Run fitted_run = numbers.run();
    rig = fitted_rig;
    run = fitted_run;
    warn(fmt::format("{}: simulated with the numbers of rig and run as the fit adjusted them; one curve, without a band for what they leave uncertain", options.fit));
  }
  if (!options.as_recorded && !options.jumps) take_out_noise_of_the_angle(rig, run);

  std::optional<TabulatedIndicial> table;
  if (!options.indicial.empty()) table = read_indicial(options.indicial);

  const std::vector<std::string> effects = put_laws(rig, fit, options.laws);
  SimulateProblem problem{{rig, basis_of(rig, run, fit, options), circulation_of(options, fit, table)}, {}, std::move(run), {}, {}, {}};
  if (!effects.empty()) problem.model = problem.model.with_effects(effects);
  const auto is_fitted = [&](const Parameter& p) { return fit->find(p.name, problem.run.file) != nullptr; };
  if (fit && std::none_of(problem.model.parameters().begin(), problem.model.parameters().end(), is_fitted))
    throw InputError({fit->file, 0}, "no parameter of the rig " + rig.file, "wanted a fit of this rig", "Fit it, or leave --fit away.");
  problem.theta = fit ? theta_for(problem.model, *fit, problem.run.file, conditions_of(problem.run).onset_angle) : problem.model.start_values();
  if (fit) problem.law_steps = fit->law_steps;
  if (fit)
    if (const FittedParameter* steady = fit->find(steady_name, problem.run.file)) problem.steady_normal_force = steady->value;
  if (table && table->slope && !rig.is_modal()) problem.theta[problem.model.index("normal_force_slope")] = *table->slope;
  for (const std::string& setting : options.settings) set(setting, problem);
  if (options.jumps) problem.pitch = PitchBetweenSamples::jumps;
  if (!options.release_load.empty()) problem.release_load = quantity(options.release_load, "N", {"--release-load", 0}, "the release load");
  return {std::move(problem), made_by};
}

SimulateResult simulate_within(const SimulateProblem& problem, const SimulateOptions& options) {
  SimulateResult result = simulate(problem);
  refuse_beyond(result.beyond, problem.run.file, options.beyond, result.warnings);
  return result;
}

namespace {

ToSimulate problem_of(const Options& options, const Provenance& made) {
  Rig rig = read_rig(options.rig);
  for (const std::string& warning : rig.warnings) warn(warning);
  Run run = read_run(options.run);
  for (const std::string& warning : run.warnings) warn(warning);
  std::optional<FittedRig> fit;
  if (!options.fit.empty()) fit = read_fit(options.fit);
  return simulate_problem(std::move(rig), std::move(run), fit, options, made);
}

/// A recording beside its prediction, but for the zero of the channel: how far the two are apart.
void print_comparison(const Run& recorded, const SimulateResult& result) {
  for (const std::string& name : result.simulated) {
    const Channel* channel = recorded.find(name);
    if (!channel) continue;
    const Eigen::ArrayXd simulated = result.run.channel(name).value;
    std::vector<Index> there;
    for (Index k = 0; k < channel->value.size(); ++k)
      if (std::isfinite(channel->value[k])) there.push_back(k);
    const Eigen::ArrayXd reading = channel->value(there), off = reading - simulated(there);
    const auto scatter = [](const Eigen::ArrayXd& x) { return std::sqrt((x - x.mean()).square().mean()); };
    fmt::print("  recorded {:<5} differs by {:.4g} {} r.m.s. beside a constant of {:.4g}; it varies by {:.4g} r.m.s.\n", name, scatter(off), channel->unit, off.mean(), scatter(reading));
  }
}

/// What was assumed, for the head of the file: whoever reads it later can run it again.
std::vector<std::string> recipe(const SimulateProblem& problem, const SimulateResult& result) {
  const AeroelasticModel& model = problem.model;
  std::vector<std::string> lines{fmt::format("simulated with the rig \"{}\"", model.rig().name)};
  if (!model.rig().is_modal())
    lines.front() += fmt::format(", {} normal and {} torsional modes, circulation {}", model.basis().normal_modes,
                                 model.basis().torsion_modes, model.circulation().name);
  for (std::size_t j = 0; j < model.parameters().size(); ++j)
    lines.push_back(
        fmt::format("{} = {:.10g} {}", model.parameters()[j].name, problem.theta[static_cast<Index>(j)], model.parameters()[j].unit));
  for (const std::string& id : model.effect_ids())
    if (is_law_id(id)) lines.push_back(fmt::format("{}: {}", id, effect(model.rig(), id).equation));
  for (const std::string& beyond : result.beyond) lines.push_back("a guess: " + beyond);
  if (problem.steady_normal_force) lines.push_back(fmt::format("{} = {:.10g} 1", steady_name, *problem.steady_normal_force));
  if (problem.release_load) lines.push_back(fmt::format("released from {:.10g} N", *problem.release_load));
  if (problem.law_steps > 1) lines.push_back(fmt::format("nonlinear laws followed in {} times the steps that they ask for, as by the fit", problem.law_steps));
  if (problem.pitch == PitchBetweenSamples::jumps) lines.emplace_back("the angle jumps between samples");
  return lines;
}

void print_summary(const SimulateProblem& problem, const SimulateResult& result, const std::string& output) {
  fmt::print("{}: {} samples of {:.6g} s\n", output, result.run.samples(), result.run.dt);
  for (const std::string& name : result.simulated) {
    const Channel& channel = result.run.channel(name);
    fmt::print("  {:<14} {: .6g} to {: .6g} {}\n", name, channel.value.minCoeff(), channel.value.maxCoeff(), channel.unit);
  }
  const LinearSystem system = problem.model.system(conditions_of(problem.run), problem.theta, {});
  for (const std::complex<double> pole : oscillatory_poles(system)) {
    const double hertz = pole.imag() / (2 * std::numbers::pi);
    if (hertz < 0.5 / result.run.dt) fmt::print("  resonance {:9.4f} Hz, damping ratio {:.5f}\n", hertz, -pole.real() / std::abs(pole));
  }
}

}  // namespace

int simulate_command(int argc, char** argv) {
  CLI::App app{"Simulates what gauge and sensors of a rig read in a run: from its angle, force or motion of the mount.", "unrig simulate"};
  Options options;
  app.add_option("--rig", options.rig, "rig file (TOML)")->required();
  app.add_option("--run", options.run,
                 "run file (CSV) with the conditions and the inputs: alpha, force, mount_velocity, mount_acceleration")
      ->required();
  app.add_option("--fit", options.fit, "parameters, modes and circulation from a fit (JSON)");
  app.add_option("-o,--output", options.output, "simulated run (CSV)")->required();
  app.add_option("--wagner", options.circulation, "circulatory build-up: 1e-4 (default), 1e-6 (largest error), jones, seed");
  app.add_option("--indicial", options.indicial, "circulatory build-up, and the slope, from the table that `unrig correct --indicial` writes");
  app.add_option("--modes", options.normal_modes, "normal modes, in place of the rig file's or the fit's")->check(CLI::PositiveNumber);
  app.add_option("--torsion-modes", options.torsion_modes, "torsional modes, likewise")->check(CLI::PositiveNumber);
  app.add_option("--law", options.laws, "file (TOML) with a law of your own that is at work, beside those of the fit; may be repeated")->allow_extra_args(false);
  app.add_option("--set", options.settings, "name=value of a model parameter (formats as in fit.json), in SI; may be repeated")->allow_extra_args(false);
  app.add_option("--release-load", options.release_load, "load at the calibration element that a pluck is released from, such as \"20 N\"");
  app.add_flag("--jumps", options.jumps, "the angle jumps from sample to sample: ideal steps, in place of a spline");
  app.add_flag("--as-recorded", options.as_recorded, "every reading of the angle as it is, its noise too; otherwise a measured angle is simulated as the smooth motion that it says");
  app.add_flag("--beyond", options.beyond, beyond_help);
  app.footer("Example:\n  unrig simulate --rig rig.toml --run step.csv --set normal.damping_ratio=0 -o simulated.csv");
  try {
    parse_command_line(app, argc, argv);
  } catch (const CLI::ParseError& e) {
    return app.exit(e) == 0 ? exit_done : exit_wrong_use;
  }

  std::vector<std::string> inputs{options.rig, options.run, options.fit, options.indicial};
  inputs.insert(inputs.end(), options.laws.begin(), options.laws.end());
  check_outputs({{"-o", options.output}}, inputs);
  const ToSimulate given = problem_of(options, provenance_of(argc, argv));
  const SimulateProblem& problem = given.problem;
  Progress progress;
  progress("simulating " + options.run);
  const SimulateResult result = simulate_within(problem, options);
  for (const std::string& warning : result.warnings) warn(warning);
  progress("writing " + options.output);
  write_text(options.output, [&](const TextSink& sink) { run_text(sink, result.run, SimulatedRun{problem.run.file, recipe(problem, result), given.made_by}.remarks()); });
  progress.clear();
  print_summary(problem, result, options.output);
  print_comparison(problem.run, result);
  return exit_done;
}

}  // namespace unrig
