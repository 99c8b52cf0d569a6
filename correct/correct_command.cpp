#include "correct/correct_command.h"

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include "core/check/gate.h"
#include "core/law/learnt_range.h"
#include "core/files/command.h"
#include "core/files/command_line.h"
#include "core/rig/fingerprint.h"
#include "core/rig/given_files.h"
#include "core/files/provenance.h"
#include "core/files/together.h"
#include "correct/correct.h"
#include "correct/correct_gate.h"
#include "correct/corrected_files.h"
#include "correct/modal/modal_load.h"
#include "fit/givens/fitted_numbers.h"

namespace unrig {

namespace {

/// Both files in one, or none.
template <class Result>
void finish(const Result& result, const std::string& output, const TextFile& further, const MadeBy& made_by, Progress& progress) {
  for (const std::string& warning : result.warnings) warn(warning);
  progress("writing " + output);
  write_together({further, {output, [&](const TextSink& sink) { to_csv(sink, result, made_by); }}});
  progress.clear();
  fmt::print("{}", report(result));
}

/// A rig of which all but the amplifier is what was fitted.
void warn_of_amplifier(const CorrectProblem& problem, std::vector<std::string>& warnings) {
  if (const std::string found = other_rig(problem.rig, problem.fit); !found.empty())
    warnings.push_back(fmt::format("{}: {}. That is right where the fitted recordings came through another amplifier than this one; otherwise fit again.", problem.rig.file, found));
}

}  // namespace

int correct_command(int argc, char** argv) {
  CLI::App app{"Takes the rig out of a gauge record: the load of a rigid rig, its circulatory part, and the indicial response.", "unrig correct"};
  std::string rig_path, fit_path, run_path, output, indicial;
  double calibration = 0;
  app.add_option("--rig", rig_path, "rig file (TOML)")->required();
  app.add_option("--fit", fit_path, "what `unrig fit` found (JSON)")->required();
  app.add_option("run", run_path, "run file (CSV) with angle and gauge, in a stream")->required();
  app.add_option("-o,--output", output, "corrected record (CSV)")->required();
  app.add_option("--indicial", indicial, "indicial response (CSV)");
  app.add_option("--calibration-error", calibration, "relative standard deviation of the gauge's calibration, in place of the rig file's")
      ->check(CLI::Range(0.0, 1.0));
  bool anyway = false, beyond = false;
  app.add_flag("--anyway", anyway, anyway_help);
  app.add_flag("--beyond", beyond, beyond_help);
  Imposed imposed;
  app.add_flag("--monotone", imposed.monotone, "impose an indicial response that never falls (else only tested)");
  app.add_option("--at-step", imposed.at_step, "impose its value at the step, 0.5 for a thin airfoil (else only tested)")->check(CLI::Range(-1.0, 2.0));
  app.footer("Example:\n  unrig correct --rig rig.toml --fit fit.json step_a.csv -o step_a_corrected.csv --indicial step_a_indicial.csv");
  try {
    parse_command_line(app, argc, argv);
  } catch (const CLI::ParseError& e) {
    return app.exit(e) == 0 ? exit_done : exit_wrong_use;
  }
  check_outputs({{"-o", output}, {"--indicial", indicial}}, {rig_path, fit_path, run_path});
  Progress progress;
  progress("reading " + run_path);
  const CorrectProblem problem{read_rig(rig_path), read_fit(fit_path), read_run(run_path), calibration, imposed, beyond};
  progress("taking the rig out of " + run_path);
  if (problem.fit.rig_fingerprint.empty()) warn(fit_path + ": it does not say what the rig was: an earlier version wrote it. Whether it belongs to " + rig_path + " was not compared.");
  const MadeBy made_by{provenance_of(argc, argv, {"--indicial"}), fingerprint(problem.rig), fingerprint(problem.run, problem.rig), fingerprint(problem.fit)};
  pass_the_gate(problem, anyway);
  if (problem.rig.is_modal()) {
    if (imposed.any() || !indicial.empty())
      throw InputError({rig_path, 0}, "a rig known only as modes", "wanted a rig with a section for an indicial response", "Leave out --indicial, --monotone and --at-step.");
    refuse_other_rig(problem.rig, problem.fit);
    CorrectProblem at = problem;
    const FittedNumbers numbers(problem.fit, problem.rig, problem.run);
    if (numbers.any()) {
      at.rig = numbers.rig();
      at.run = numbers.run();
      at.fit.rig_fingerprint.clear();
      warn("the band of the load does not allow for the uncertainties that rig file and run state: it does so for a rig with a section only");
    }
    ModalLoad load = modal_load(at);
    warn_of_amplifier(problem, load.warnings);
    finish(load, output, {}, made_by, progress);
    return exit_done;
  }
  CorrectResult result = correct(problem);
  warn_of_amplifier(problem, result.warnings);
  finish(result, output, {indicial, [&](const TextSink& sink) { sink(to_indicial_csv(result, made_by)); }}, made_by, progress);
  if (result.no_answer.empty()) return exit_done;
  warn("no trustworthy answer: " + result.no_answer);
  return exit_no_answer;
}

}  // namespace unrig
