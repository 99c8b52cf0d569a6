#include "correct/batch/batch_command.h"

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <tuple>

#include "core/files/command.h"
#include "core/files/command_line.h"
#include "core/files/error.h"
#include "core/rig/given_files.h"
#include "correct/batch/batch.h"
#include "correct/batch/batch_files.h"
#include "correct/batch/batch_outputs.h"
#include "fit/trial/shard.h"

namespace unrig {
namespace {

constexpr const char* example = R"(Example of a file of campaigns; paths and patterns begin in its folder:
  unrig_batch = 1
  rig = "rig.toml"                       # of all that name none of their own
  commands = ["check", "fit", "correct"]  # of these, diagnose and apparent-mass
  [[campaign]]
  name = "monday"
  runs = ["monday/*_pluck.csv", "monday/step_?.csv"]  # fitted together
  further = ["monday/sweep_*.csv"]       # corrected with that fit
  [[campaign]]
  folder = "2026-*"                      # one campaign for each such folder
  rig = "rig.toml"
  runs = ["*.csv"]

Example:
  unrig batch campaigns.toml -o table.csv --report table.html
  for i in 1 2 3; do unrig batch campaigns.toml --shard $i/3 -o part$i.json; done; unrig collect part*.json -o table.csv)";

/// Beside the output, called as the file of campaigns, so that shards that write into one folder share it.
std::string usual_folder(const std::string& campaigns, const std::string& output) {
  namespace fs = std::filesystem;
  return (fs::path(output).parent_path() / (fs::path(campaigns).stem().string() + ".cases")).string();
}

}  // namespace

int batch_command(int argc, char** argv) {
  BatchProblem problem;
  CLI::App app{"Checks, fits, corrects and diagnoses many campaigns: one table with a row for each run. What was computed once is found again.", "unrig batch"};
  std::string campaigns, output, page, shard;
  app.add_option("campaigns", campaigns, "which runs belong together, which rig, which commands (TOML)")->required();
  app.add_option("-o,--output", output, "table (CSV); as FILE.json what `unrig collect` puts together")->required();
  app.add_option("--report", page, "the table as a page too (HTML)");
  app.add_option("--shard", shard, "i/n: only every n-th campaign, from the i-th on, for `unrig collect` to put together; without it, what falls to this task of Slurm (SLURM_ARRAY_TASK_ID) or this rank of Open MPI");
  app.add_option("--cases", problem.cases, "folder in which the result of each command is kept: a second call computes only what is missing; without it CAMPAIGNS.cases beside the output");
  app.add_option("--threads", problem.threads, "how many cases at a time; without it, as many as the machine has processors")->check(CLI::Range(1, 256));
  app.footer(example);
  try {
    parse_command_line(app, argc, argv);
  } catch (const CLI::ParseError& e) {
    return app.exit(e) == 0 ? exit_done : exit_wrong_use;
  }
  check_outputs({{"-o", output}, {"--report", page}}, {campaigns});
  std::tie(problem.shard, problem.shards) = shard_of(shard);
  problem.hand_out = hand_out_of(shard);
  if (problem.shards > 1 && !output.ends_with(".json"))
    throw InputError({output, 0}, fmt::format("shard {}/{} is a part of the table", problem.shard, problem.shards), "wanted -o FILE.json for a part", "`unrig collect` makes the table of all parts.");
  problem.batch = read_batch(campaigns);
  for (const BatchCampaign& campaign : problem.batch.campaigns) {
    std::vector<std::string> inputs{campaign.rig};
    for (const std::vector<std::string>& files : {campaign.all_runs(), campaign.laws}) inputs.insert(inputs.end(), files.begin(), files.end());
    for (std::string& input : inputs) input = (std::filesystem::path(problem.batch.folder) / input).string();
    for (const std::string& path : {output, page})
      if (const auto same = std::find_if(inputs.begin(), inputs.end(), [&](const std::string& input) { return same_file(path, input); }); same != inputs.end())
        throw InputError({path, 0}, "it would overwrite the input " + *same, "wanted an output that is none of the inputs", "Choose another name.");
  }
  if (problem.cases.empty()) problem.cases = usual_folder(campaigns, output);
  Progress progress;
  problem.progress = [&](const std::string& what) { progress(what); };
  const BatchResult result = run_batch(problem);
  progress.clear();
  write_batch(result, output, page);
  fmt::print("{}", report(result));
  if (!result.cases.empty() && std::none_of(result.cases.begin(), result.cases.end(), [](const auto& one) { return one.second.status == CaseStatus::done; }))
    throw NoAnswer("no command on any campaign has an answer: see the messages in " + output);
  return exit_done;
}

}  // namespace unrig
