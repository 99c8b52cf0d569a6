#include "fit/diagnose/diagnose_command.h"

#include <algorithm>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include "core/check/gate.h"
#include "core/files/command.h"
#include "core/files/command_line.h"
#include "core/files/error.h"
#include "core/rig/given_files.h"
#include "core/numerics/in_parallel.h"
#include "core/files/provenance.h"
#include "core/files/text_file.h"
#include "core/files/together.h"
#include "core/run/release.h"
#include "fit/diagnose/diagnose.h"
#include "fit/diagnose/diagnosis_files.h"
#include "fit/effect_option.h"
#include "fit/fit_files.h"

namespace unrig {
namespace {

void check_heldout(const std::vector<std::string>& heldout, const std::vector<std::string>& fitted) {
  check_given_once(heldout);
  for (const std::string& path : heldout)
    for (const std::string& run : fitted)
      if (same_file(path, run))
        throw InputError({path, 0}, "--heldout is among the runs too", "wanted another: a run that was fitted cannot test the prediction", "Leave it out of the runs, or leave --heldout away: then each run is left out in turn.");
}

/// A copy of a run under another name is that run.
void check_recordings(const DiagnoseProblem& problem) {
  check_recorded_once(problem.runs, problem.rig);
  check_recorded_once(problem.heldout, problem.rig);
  for (const Run& run : problem.heldout)
    if (const Run* fitted = same_recording(run, problem.runs, problem.rig))
      throw InputError({run.file, 0}, "--heldout holds the same readings as the run " + fitted->file, "wanted another: a run that was fitted cannot test the prediction", "Leave one of them out.");
}

}  // namespace

int diagnose_command(int argc, char** argv) {
  DiagnoseProblem problem;
  CLI::App app{"Says where recordings and the model of their rig differ, and which physics was left out.", "unrig diagnose"};
  std::string rig, output, fit_output;
  std::vector<std::string> runs, heldout, ids;
  app.add_option("--rig", rig, "rig file (TOML)")->required();
  app.add_option("runs", runs, "run files (CSV) of this rig, in any number")->required();
  app.add_option("--heldout", heldout, "run that is not fitted but predicted (repeatable)")->allow_extra_args(false);
  app.add_option("--effects", ids, "candidates, separated by commas; without it, all that can act in these runs")->delimiter(',')->allow_extra_args(false);
  bool no_law = false;
  app.add_flag("--no-law", no_law, "does not look for a law where no effect explains the runs");
  problem.work = usual_work;
  problem.limit = usual_seconds;
  app.add_option("--work", problem.work, "billions of multiplications after which the search ends with what it has found, whatever the machine's speed; inf: any")->check(wrong_with_limit)->capture_default_str();
  app.add_option("--limit", problem.limit, "the same in seconds of processor time; inf: any")->check(wrong_with_limit)->capture_default_str();
  app.add_option_function<int>("--threads", use_threads, "how many threads to work in; without it, as many as the machine has")->check(CLI::Range(1, 256));
  app.add_option("--fit", fit_output, "writes the winning fit too (fit.json), for simulate and correct");
  app.add_option("-o,--output", output, "result (JSON)")->required();
  bool anyway = false;
  app.add_flag("--anyway", anyway, anyway_help);
  app.footer("Example:\n  unrig diagnose --rig rig.toml dry_pluck.csv wet_pluck.csv step_a.csv step_b.csv --heldout step_c.csv -o diagnosis.json");
  try {
    parse_command_line(app, argc, argv);
  } catch (const CLI::ParseError& e) {
    return app.exit(e) == 0 ? exit_done : exit_wrong_use;
  }
  std::vector<std::string> inputs = runs;
  inputs.insert(inputs.end(), heldout.begin(), heldout.end());
  inputs.push_back(rig);
  check_outputs({{"-o", output}, {"--fit", fit_output}}, inputs);
  check_given_once(runs);
  check_heldout(heldout, runs);
  problem.rig = read_rig(rig);
  for (const std::string& path : runs) problem.runs.push_back(read_run(path));
  for (const std::string& path : heldout) problem.heldout.push_back(read_run(path));
  check_recordings(problem);
  problem.laws = !no_law;
  problem.effects = effects_of_option("--effects", ids);
  refuse_idle("--effects", problem.effects, problem.rig, problem.runs);
  std::vector<Run> all = problem.runs;
  all.insert(all.end(), problem.heldout.begin(), problem.heldout.end());
  pass_the_gate(problem.rig, all, anyway);
  Progress progress;
  problem.progress = [&](const std::string& what) { progress(what); };
  Diagnosis diagnosis = diagnose(problem);
  const Provenance made = provenance_of(argc, argv, {"--fit"});
  diagnosis.after.program = made.program;
  diagnosis.after.command = made.command;
  progress.clear();
  for (const std::string& warning : problem.rig.warnings) warn(warning);
  const bool rig_is_off = std::any_of(diagnosis.missing.begin(), diagnosis.missing.end(), [](const MissingEffect& m) { return m.effect == rig_description_id; });
  if (rig_is_off && !fit_output.empty()) warn(fit_output + ": the fit is of the rig as its file has it, which the diagnosis holds for off. State how well its numbers are known, and fit anew");
  const auto whole = [](const std::string& text) { return [&text](const TextSink& sink) { sink(text); }; };
  const std::string told = to_json(diagnosis), fitted = fit_output.empty() ? std::string() : to_json(diagnosis.after, diagnosis.laws);
  write_together({{output, whole(told)}, {fit_output, whole(fitted)}});
  fmt::print("{}", report(diagnosis));
  for (const Run& run : all)
    if (run.hold) fmt::print("    {}: {}\n", base_name(run.file), said_of(*run.hold));
  const std::string work = diagnosis.work < 10 ? fmt::format("{:.2g}", diagnosis.work) : fmt::format("{:.0f}", diagnosis.work);
  fmt::print("    {:.1f} s, {}e9 multiplications\n", diagnosis.seconds, work);
  return diagnosis.unexplained ? exit_no_answer : exit_done;
}

}  // namespace unrig
