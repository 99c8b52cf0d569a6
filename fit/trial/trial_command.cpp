#include "fit/trial/trial_command.h"

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include <tuple>

#include "core/files/command.h"
#include "core/files/command_line.h"
#include "core/files/error.h"
#include "core/rig/given_files.h"
#include "core/numerics/in_parallel.h"
#include "core/files/provenance.h"
#include "core/files/text_file.h"
#include "core/files/units.h"
#include "fit/trial/shard.h"
#include "fit/trial/trial_files.h"
#include "fit/effect_option.h"

namespace unrig {

int trial_command(int argc, char** argv) {
  TrialProblem problem;
  CLI::App app{"Hides effects in simulated campaigns of a rig and counts how often `unrig diagnose` finds them.", "unrig trial"};
  std::string rig, output, noise, shard;
  std::vector<std::string> ids, recordings;
  app.add_option("--rig", rig, "rig file (TOML)")->required();
  app.add_option("runs", recordings, "recordings (CSV) that the simulated runs repeat: their conditions, motion, release, sampling and noise; without any, two plucks and three steps are drawn");
  CLI::Option* const effects = app.add_option("--effects", ids, "effects to hide in turn, and the candidates, separated by commas; without it, all")->delimiter(',')->allow_extra_args(false);
  app.add_option("--trials", problem.trials, "campaigns; every so many-th hides nothing")->capture_default_str()->check(CLI::Range(1, 1000000));
  CLI::Option* const pairs = app.add_flag("--pairs", problem.pairs, "hide two effects at a time");
  app.add_option("--work", problem.work, "billions of multiplications after which each search ends with what it has found; inf: any")->check(wrong_with_limit)->capture_default_str();
  app.add_option("--seed", problem.seed, "of the random numbers")->capture_default_str();
  app.add_option("--noise", noise, "standard deviation of the gauge's noise; without it that of the recordings, or 0.03 N; with --law drawn from 0.03 to 0.3 N");
  app.add_flag("--outside", problem.outside, "keep what is hidden from the candidates: the right verdict is `unexplained`; with --law, hide laws that the dictionary cannot say");
  CLI::Option* const nulls = app.add_flag("--nulls", problem.nulls, "hide nothing in any campaign: every name is a false alarm")->excludes(pairs)->excludes("--outside");
  app.add_flag("--law", problem.laws, "hide a law in each campaign, in turn those of the dictionary that `diagnose` searches, with parameters drawn; two more runs are held out")->excludes(pairs)->excludes(nulls)->excludes(effects);
  app.add_flag("--ideal", problem.ideal, "white noise, exact files and steady signals. Without it noise may be first-order, pink, heavy-tailed or quantised, in a quarter of the campaigns one kind of number in the files is off, in another all are and the files state by how much, and the phase of vortex shedding walks");
  app.add_option("--shard", shard, "i/n: only every n-th campaign, from the i-th on, for `unrig collect` to put together; without it, what falls to this task of Slurm (SLURM_ARRAY_TASK_ID) or this rank of Open MPI");
  app.add_option("--cases", problem.cases, "folder in which the outcome of each campaign is kept: a second call computes only what is missing");
  app.add_option_function<int>("--threads", use_threads, "how many threads to work in; without it, as many as the machine has")->check(CLI::Range(1, 256));
  app.add_option("-o,--output", output, "result (JSON)")->required();
  app.footer("Example:\n  unrig trial --rig rig.toml dry_pluck.csv wet_pluck.csv step.csv --effects tank-wave,gauge-lowpass --trials 30 -o trial.json");
  try {
    parse_command_line(app, argc, argv);
  } catch (const CLI::ParseError& e) {
    return app.exit(e) == 0 ? exit_done : exit_wrong_use;
  }
  std::vector<std::string> inputs = recordings;
  inputs.push_back(rig);
  check_outputs({{"-o", output}}, inputs);
  check_given_once(recordings);
  std::tie(problem.shard, problem.shards) = shard_of(shard);
  problem.hand_out = hand_out_of(shard);
  problem.rig = read_rig(rig);
  problem.rig.givens = nullptr;  // its simulated rigs have just these numbers
  for (const std::string& warning : problem.rig.warnings) warn(warning);
  for (const std::string& path : recordings) problem.recordings.push_back(read_run(path));
  for (Run& run : problem.recordings) run.givens = nullptr;
  check_recorded_once(problem.recordings, problem.rig);
  for (const Run& run : problem.recordings)
    for (const std::string& warning : run.warnings) warn(warning);
  if (!noise.empty()) {
    problem.noise = quantity(noise, "N", {"--noise", 0}, "the noise");
    if (!(*problem.noise > 0)) throw InputError({"--noise", 0}, "noise of " + noise, "wanted more than none", "");
  }
  problem.effects = effects_of_option("--effects", ids);
  Progress progress;
  problem.progress = [&](const std::string& what) { progress(what); };
  const TrialResult result = run_trials(problem);
  progress.clear();
  write_text(output, to_json(result, provenance_of(argc, argv, {"--cases"})));
  fmt::print("{}", report(result));
  if (result.failures > 0 && static_cast<std::size_t>(result.failures) == result.outcomes.size()) throw NoAnswer("no campaign could be diagnosed: " + result.outcomes.front().failure);
  return exit_done;
}

}  // namespace unrig
