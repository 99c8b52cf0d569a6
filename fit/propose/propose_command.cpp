#include "fit/propose/propose_command.h"

#include <CLI/CLI.hpp>
#include <algorithm>

#include <fmt/format.h>

#include "core/files/command.h"
#include "core/files/command_line.h"
#include "core/files/provenance.h"
#include "core/files/together.h"
#include "core/numerics/in_parallel.h"
#include "core/rig/given_files.h"
#include "fit/givens/inexact_rig.h"
#include "fit/propose/plan_files.h"
#include "fit/propose/propose.h"

namespace unrig {

int propose_command(int argc, char** argv) {
  ProposeProblem problem;
  PlanPaths paths;
  paths.runs = 8;
  CLI::App app{"Says which run to record next: the one that would decide between explanations that a diagnosis cannot tell apart.", "unrig propose"};
  app.add_option("diagnosis", paths.diagnosis, "what `unrig diagnose` wrote (JSON); rig and runs are found by the paths in it")->required();
  app.add_option("--limits", paths.limits, "what can be recorded (TOML): largest pluck load, angle, rate, speed, force, and the media")->required();
  app.add_option("-o,--output", paths.plan, "plan (TOML); its motions stand beside it as PLAN_1.csv, PLAN_2.csv ..., for `unrig simulate`")->required();
  app.add_option("--runs", paths.runs, "how many motions to write, the best ones")->check(CLI::Range(1, 100))->capture_default_str();
  app.add_option("--refits", problem.refits, "how many candidates to simulate and refit for each pair of explanations; the others are ranked to first order")->check(CLI::Range(1, 1000))->capture_default_str();
  app.add_option("--draws", problem.draws, "how often to do so with noise and drawn parameters for the best, under each explanation")->check(CLI::Range(0, 1000))->capture_default_str();
  app.add_option("--seed", problem.seed, "of noise and drawn parameters")->capture_default_str();
  app.add_option_function<int>("--threads", use_threads, "how many threads to work in; without it, as many as the machine has")->check(CLI::Range(1, 256));
  app.footer(
      "limits.toml, every key but the first optional; what is not named is not proposed:\n"
      "  unrig_limits = 1\n"
      "  pluck_load = \"40 N\"            # largest load that a free decay is released from\n"
      "  angle = [\"-2 deg\", \"10 deg\"]   # of the shaft, with\n"
      "  rate = \"60 deg/s\"              # its largest rate\n"
      "  angle_noise = \"0.01 deg\"      # of the measured angle, where no step at hand shows it\n"
      "  speed = \"0.8 m/s\"              # largest; without it the speeds of the runs at hand\n"
      "  force = \"20 N\"                 # largest measured force\n"
      "  duration = \"10 s\"              # without it that of the runs at hand\n"
      "  medium = [{ name = \"water\", density = \"998.2 kg/m^3\" }]   # without it those of the runs at hand\n"
      "Exit status 1: for some pair no run within the limits is known to decide.\n"
      "\nExample:\n  unrig propose diagnosis.json --limits limits.toml -o plan.toml");
  try {
    parse_command_line(app, argc, argv);
  } catch (const CLI::ParseError& e) {
    return app.exit(e) == 0 ? exit_done : exit_wrong_use;
  }
  const auto outputs = [&] {
    std::vector<Output> all{{"-o", paths.plan}};
    for (std::size_t k = 0; k < paths.runs; ++k) all.push_back({"-o", paths.motion(k)});
    return all;
  };
  check_outputs(outputs(), {paths.diagnosis, paths.limits});
  problem.limits = read_limits(paths.limits);
  problem.rivals = read_rivals(paths.diagnosis);
  check_outputs(outputs(), problem.rivals.inputs);
  paths.rig = problem.rivals.inputs.front();
  if (states_errors(problem.rivals.rig, problem.rivals.runs)) warn("uncertainties that rig file and runs state are not allowed for: the plan takes their numbers as exact");
  for (const std::string& warning : problem.rivals.rig.warnings) warn(warning);
  Progress progress;
  problem.progress = [&](const std::string& what) { progress(what); };
  const Plan plan = propose(problem);
  progress.clear();
  write_together(plan_files(plan, paths, provenance_of(argc, argv)));
  fmt::print("{}", report(plan, paths));
  const bool all_decided = std::all_of(plan.comparisons.begin(), plan.comparisons.end(), [](const Comparison& c) { return c.decides(); });
  if (!all_decided) warn("no trustworthy answer: not every pair of explanations has a run within these limits that is known to decide between them");
  return all_decided ? exit_done : exit_no_answer;
}

}  // namespace unrig
