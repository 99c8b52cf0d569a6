#include "core/new/new_command.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <string>
#include <vector>

#include "core/files/command.h"
#include "core/files/command_line.h"
#include "core/files/error.h"
#include "core/files/near_word.h"
#include "core/files/questions.h"
#include "core/files/text_file.h"
#include "core/new/rig_templates.h"
#include "core/new/run_template.h"
#include "core/rig/given_files.h"
#include "core/rig/parse_rig.h"

namespace unrig {
namespace {

constexpr RunKind kinds[] = {RunKind::step, RunKind::pluck, RunKind::forced, RunKind::moved};

RunKind kind_called(const std::string& name) {
  std::vector<std::string> names;
  for (const RunKind kind : kinds) {
    if (to_string(kind) == name) return kind;
    names.push_back(to_string(kind));
  }
  const std::string meant = nearest_word(name, names);
  throw InputError({"--kind", 0}, fmt::format("there is no kind \"{}\" of a run", name), "wanted step, pluck, forced or moved", meant.empty() ? "" : "Did you mean " + meant + "?");
}

/// The rig whose run is written: the user's, or the template that such a run belongs to.
Rig rig_of_run(const std::string& path, RunKind kind) {
  if (!path.empty()) return read_rig(path);
  const RigTemplate& chosen = rig_template(kind == RunKind::forced || kind == RunKind::moved ? "impact-test" : "tube");
  return parse_rig(chosen.text, std::string("the template ") + chosen.name);
}

std::string footer() {
  std::string text = "Rigs (--from):\n";
  for (const RigTemplate& one : rig_templates()) text += fmt::format("  {:<12} {}\n", one.name, one.summary);
  return text +
         "\nBoth files read as they stand; lines with \"# ?\" ask what only you know. Without -o the file goes to standard output.\n\n"
         "Example:\n  unrig new rig --from tube -o rig.toml\n  unrig new run --rig rig.toml --kind step -o step.csv\n  unrig check --rig rig.toml step.csv";
}

struct Asked {
  std::string what, from, kind, rig, output;
  bool force = false;
};

void check_options(const Asked& asked) {
  const InputError::Place place{"unrig new " + asked.what, 0};
  if (asked.what == "rig" && asked.from.empty()) {
    std::string names;
    for (const RigTemplate& one : rig_templates()) names += fmt::format("{}{}", names.empty() ? "" : ", ", one.name);
    throw InputError(place, "--from is missing", "wanted what is known of the rig: " + names, "`unrig new --help` says what they are.");
  }
  if (asked.what == "rig" && !(asked.kind.empty() && asked.rig.empty())) throw InputError(place, asked.kind.empty() ? "--rig" : "--kind", "wanted it only for a run", "");
  if (asked.what == "run" && !asked.from.empty()) throw InputError(place, "--from", "wanted it only for a rig; for a run --kind and --rig", "");
}

}  // namespace

int new_command(int argc, char** argv) {
  CLI::App app{"Writes a rig or run file to begin with: an example that reads as it stands, with remarks, units and questions.", "unrig new"};
  Asked asked;
  app.add_option("what", asked.what, "rig or run")->required();
  app.add_option("--from", asked.from, "of a rig: what it is made from (below)");
  app.add_option("--kind", asked.kind, "of a run: step (default), pluck, forced or moved");
  app.add_option("--rig", asked.rig, "of a run: the rig file (TOML) whose gauge and sensors it has; default: the template tube, of forced and moved runs impact-test");
  app.add_option("-o,--output", asked.output, "the file");
  app.add_flag("--force", asked.force, "write over a file that is there");
  app.footer(footer());
  try {
    parse_command_line(app, argc, argv);
  } catch (const CLI::ParseError& e) {
    return app.exit(e) == 0 ? exit_done : exit_wrong_use;
  }
  if (asked.what != "rig" && asked.what != "run") throw InputError({"unrig new", 0}, fmt::format("\"{}\" is neither rig nor run", asked.what), "wanted `unrig new rig` or `unrig new run`", "");
  check_options(asked);
  check_outputs({{"-o", asked.output}}, {asked.rig});
  refuse_overwriting(asked.output, asked.force);

  const RunKind kind = asked.kind.empty() ? RunKind::step : kind_called(asked.kind);
  const std::string text = asked.what == "rig" ? rig_template(asked.from).text : run_template(kind, rig_of_run(asked.rig, kind));
  if (asked.output.empty()) {
    std::fwrite(text.data(), 1, text.size(), stdout);
    return exit_done;
  }
  write_text(asked.output, text);
  fmt::print("{}: an example that reads as it stands, with {} questions to you (lines that begin with \"{}\")\n", asked.output, questions_in(text), asked.what == "run" ? "# # ?" : "# ?");
  if (asked.what == "rig") fmt::print("look at it:  unrig check --rig {}\n", asked.output);
  else fmt::print("look at it:  unrig check --rig {} {}\n", asked.rig.empty() ? "RIG" : asked.rig, asked.output);
  return exit_done;
}

}  // namespace unrig
