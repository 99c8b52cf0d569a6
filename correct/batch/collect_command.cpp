#include "correct/batch/collect_command.h"

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "core/files/command.h"
#include "core/files/command_line.h"
#include "core/files/error.h"
#include "core/files/text_file.h"
#include "core/rig/given_files.h"
#include "correct/batch/batch_files.h"
#include "correct/batch/batch_outputs.h"
#include "fit/trial/trial_files.h"

namespace unrig {
namespace {

using Strings = std::vector<std::string>;

/// A part as JSON where it is one of a batch; null otherwise.
nlohmann::ordered_json batch_json(const std::string& path) {
  nlohmann::ordered_json json = nlohmann::ordered_json::parse(read_text(path), nullptr, false);
  return json.is_object() && json.value("unrig", std::string()) == "batch" ? json : nlohmann::ordered_json();
}

void collect_trial(const Strings& parts, const std::string& output) {
  std::vector<TrialResult> shards;
  for (const std::string& path : parts) shards.push_back(read_trial(path));
  const TrialResult all = collected(shards, parts);
  write_text(output, to_json(all, {provenance_of(0, nullptr).program, ""}, false));
  fmt::print("{}", report(all));
}

void collect_batch(const Strings& parts, const std::string& output, const std::string& page) {
  std::vector<BatchResult> shards;
  for (const std::string& path : parts) {
    const nlohmann::ordered_json json = batch_json(path);
    if (json.is_null()) throw InputError({path, 0}, "no part of a batch, as " + parts.front() + " is", "wanted what `unrig batch -o FILE.json` wrote", "Collect each study by itself.");
    shards.push_back(batch_result(json, path));
  }
  const BatchResult all = collected(shards, parts);
  write_batch(all, output, page);
  fmt::print("{}", report(all));
}

}  // namespace

int collect_command(int argc, char** argv) {
  CLI::App app{"Puts the shards of `unrig trial` or `unrig batch` together: the same bytes for any number of shards, in any order.", "unrig collect"};
  Strings parts;
  std::string output, page;
  app.add_option("parts", parts, "results of all shards (JSON)")->required();
  app.add_option("-o,--output", output, "result: of a trial JSON, of a batch its table (CSV) or, as FILE.json, all of it")->required();
  app.add_option("--report", page, "the table of a batch as a page too (HTML)");
  app.footer("Example:\n  for i in 1 2 3; do unrig trial --rig rig.toml --trials 300 --shard $i/3 -o part$i.json; done\n  unrig collect part1.json part2.json part3.json -o trial.json");
  try {
    parse_command_line(app, argc, argv);
  } catch (const CLI::ParseError& e) {
    return app.exit(e) == 0 ? exit_done : exit_wrong_use;
  }
  check_outputs({{"-o", output}, {"--report", page}}, parts);
  check_given_once(parts);
  std::sort(parts.begin(), parts.end());
  if (!batch_json(parts.front()).is_null()) {
    collect_batch(parts, output, page);
    return exit_done;
  }
  if (!page.empty()) throw InputError({page, 0}, "--report with the parts of a trial", "wanted parts of a batch", "`unrig report` makes a page of what is collected here.");
  collect_trial(parts, output);
  return exit_done;
}

}  // namespace unrig
