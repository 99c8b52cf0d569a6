#include "fit/check/check_command.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

#include "core/files/command.h"
#include "core/files/command_line.h"
#include "core/files/text_file.h"
#include "core/rig/given_files.h"
#include "fit/check/check.h"

namespace unrig {
int check_command(int argc, char** argv) {
  CLI::App app{"Are rig file and recordings plausible, and what can they determine? A rig alone: its modes, masses and loads.", "unrig check"};
  std::string rig_path, output;
  std::vector<std::string> run_paths;
  app.add_option("--rig", rig_path, "rig file (TOML)")->required();
  app.add_option("runs", run_paths, "run files (CSV) of this rig");
  app.add_option("-o,--output", output, "the numbers (JSON)");
  app.footer("A suspicion is a line on standard error that begins with \"check:\" and names the run, the likely cause and the factor; the exit status is 1 where no fit of such input can be trusted.\n\n"
             "Example:\n  unrig check --rig rig.toml dry_pluck.csv wet_pluck.csv step_a.csv -o check.json");
  try {
    parse_command_line(app, argc, argv);
  } catch (const CLI::ParseError& e) {
    return app.exit(e) == 0 ? exit_done : exit_wrong_use;
  }
  std::vector<std::string> inputs = run_paths;
  inputs.push_back(rig_path);
  check_outputs({{"-o", output}}, inputs);
  check_given_once(run_paths);

  const Rig rig = read_rig(rig_path);
  std::vector<Run> runs;
  for (const std::string& path : run_paths) runs.push_back(read_run(path));
  for (const std::string& warning : rig.warnings) warn(warning);
  for (const Run& run : runs)
    for (const std::string& warning : run.warnings) warn(warning);

  Checked checked = check(rig, runs);
  checked.made = provenance_of(argc, argv);

  tell(checked.suspicions);
  if (!output.empty()) write_text(output, to_json(checked));
  fmt::print("{}", report(checked));
  return any_grave(checked.suspicions) ? exit_no_answer : exit_done;
}

}  // namespace unrig
