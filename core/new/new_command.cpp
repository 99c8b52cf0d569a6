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
#include "core/files/provenance.h"
#include "core/modal_test/rig_of_modes.h"
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
         "Example:\n  unrig new rig --from tube -o rig.toml\n  unrig new run --rig rig.toml --kind step -o step.csv\n  unrig check --rig rig.toml step.csv\n  unrig new rig --from impact-test frf.unv --averages 5 -o rig.toml";
}

struct Asked {
  std::string what, from, kind, rig, output;
  std::vector<std::string> functions;
  ModalFitOptions modal;
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
  if (!asked.functions.empty() && (asked.what != "rig" || asked.from != "impact-test")) throw InputError(place, fmt::format("the file {}", asked.functions.front()), "wanted files only for `unrig new rig --from impact-test`", "");
  if (asked.functions.empty() && (asked.modal.modes > 0 || asked.modal.averages > 0)) throw InputError(place, asked.modal.modes > 0 ? "--modes" : "--averages", "wanted it only beside frequency response functions", "");
  if (asked.what == "run" && !asked.from.empty()) throw InputError(place, "--from", "wanted it only for a rig; for a run --kind and --rig", "");
}

/// A rig from measured functions instead of an example.
int rig_from_functions(const Asked& asked, int argc, char** argv) {
  Progress progress;
  std::vector<FrequencyResponse> functions;
  for (const std::string& file : asked.functions) {
    progress("reading " + file);
    for (FrequencyResponse& f : read_frequency_responses(file)) {
      for (const FrequencyResponse& other : functions)
        if (other.name == f.name) throw InputError(f.place, fmt::format("a second function \"{}\", beside that of {}", f.name, other.place.file), "wanted functions of different names", "Rename a table: its function has the file's name.");
      functions.push_back(std::move(f));
    }
  }
  progress("fitting modes");
  const ModalFit fit = fit_modes(functions, asked.modal);
  const Provenance made = provenance_of(argc, argv);
  const RigOfModes rig = rig_of_modes(functions, fit, made.program + ", " + made.command);
  progress.clear();
  parse_rig(rig.text, asked.output.empty() ? "the rig" : asked.output);  // what no command could read is not written
  for (const std::string& warning : rig.warnings) warn(warning);
  if (asked.output.empty()) {
    std::fwrite(rig.text.data(), 1, rig.text.size(), stdout);
    return exit_done;
  }
  write_text(asked.output, rig.text);
  fmt::print("{}: {} mode{} from {} frequency response function{}, with {} questions to you (lines that begin with \"# ?\")\n{}look at it:  unrig check --rig {}\n", asked.output, fit.modes.size(), fit.modes.size() == 1 ? "" : "s", functions.size(),
             functions.size() == 1 ? "" : "s", questions_in(rig.text), rig.report, asked.output);
  return exit_done;
}

}  // namespace

int new_command(int argc, char** argv) {
  CLI::App app{"Writes a rig or run file to begin with: an example that reads as it stands, with remarks, units and questions.", "unrig new"};
  Asked asked;
  app.add_option("what", asked.what, "rig or run")->required();
  app.add_option("functions", asked.functions, "of --from impact-test: measured frequency response functions (universal file 58, or tables), whose modes it finds");
  app.add_option("--modes", asked.modal.modes, "how many modes to find in them; default: as many as they show (BIC)")->check(CLI::Range(1, 50));
  app.add_option("--averages", asked.modal.averages, "blows that were averaged in them: with their coherence it says how large the errors are")->check(CLI::Range(1, 1000000));
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
  std::vector<std::string> inputs = asked.functions;
  inputs.push_back(asked.rig);
  check_outputs({{"-o", asked.output}}, inputs);
  refuse_overwriting(asked.output, asked.force);
  if (!asked.functions.empty()) return rig_from_functions(asked, argc, argv);

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
