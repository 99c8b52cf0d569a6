#include "fit/trial/collect_command.h"

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include <algorithm>
#include <string>
#include <vector>

#include "core/files/command.h"
#include "core/files/command_line.h"
#include "core/rig/given_files.h"
#include "core/files/text_file.h"
#include "fit/trial/trial_files.h"

namespace unrig {

int collect_command(int argc, char** argv) {
  CLI::App app{"Puts the shards of a study by `unrig trial --shard` together: the same bytes for any number of shards, in any order.", "unrig collect"};
  std::vector<std::string> parts;
  std::string output;
  app.add_option("parts", parts, "results of all shards (JSON)")->required();
  app.add_option("-o,--output", output, "result (JSON)")->required();
  app.footer("Example:\n  for i in 1 2 3; do unrig trial --rig rig.toml --trials 300 --shard $i/3 -o part$i.json; done\n  unrig collect part1.json part2.json part3.json -o trial.json");
  try {
    parse_command_line(app, argc, argv);
  } catch (const CLI::ParseError& e) {
    return app.exit(e) == 0 ? exit_done : exit_wrong_use;
  }
  check_outputs({{"-o", output}}, parts);
  check_given_once(parts);
  std::sort(parts.begin(), parts.end());
  std::vector<TrialResult> shards;
  for (const std::string& path : parts) shards.push_back(read_trial(path));
  const TrialResult all = collected(shards, parts);
  write_text(output, to_json(all, {provenance_of(0, nullptr).program, ""}, false));
  fmt::print("{}", report(all));
  return exit_done;
}

}  // namespace unrig
