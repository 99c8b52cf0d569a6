#include "fit/fit_command.h"

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include <algorithm>
#include <filesystem>

#include "core/check/gate.h"
#include "core/files/command.h"
#include "core/files/command_line.h"
#include "core/rig/given_files.h"
#include "core/numerics/in_parallel.h"
#include "core/files/provenance.h"
#include "core/files/text_file.h"
#include "fit/check/implausible_parameters.h"
#include "fit/effect_option.h"
#include "fit/fit.h"
#include "fit/fit_files.h"
#include "fit/fit_report.h"
#include "fit/givens/price.h"

namespace unrig {

int fit_command(int argc, char** argv) {
  FitProblem problem;
  CLI::App app{"Fits stiffness, damping and apparent mass of a rig to recordings, all together.", "unrig fit"};
  std::string rig_path, output, circulation = "1e-4";
  std::vector<std::string> run_paths, starts, effect_ids, law_paths;
  double least = 0.1;
  bool price = false, anyway = false;
  app.add_option("--rig", rig_path, "rig file (TOML)")->required();
  app.add_option("runs", run_paths, "run files (CSV): free decays and steps of this rig, one or more");
  app.add_option("-o,--output", output, "result (JSON)")->required();
  app.add_option("--effect", effect_ids, "physics beyond the rig model that is at work, one of those below (repeatable)")->allow_extra_args(false);
  app.add_option("--law", law_paths, "file (TOML) with a law of your own that is at work (repeatable); the manual's laws.md says how it is written")->allow_extra_args(false);
  app.add_option("--start", starts, "start value of a parameter, NAME=VALUE (repeatable)")->allow_extra_args(false);
  CLI::Option* const profile = app.add_option("--profile", problem.profile, "profile-likelihood intervals (68 %, 95 %) of these parameters; without a name, of all that were fitted")->expected(0, -1);
  app.add_option("--wagner", circulation, "circulatory build-up: 1e-4, 1e-6 (largest error), jones, seed")->capture_default_str();
  app.add_option_function<int>("--threads", use_threads, "how many threads to work in; without it, as many as the machine has")->check(CLI::Range(1, 256));
  app.add_option("--correlations", least, "smallest correlation to report")->capture_default_str();
  app.add_flag("--price", price, "how much an error of one per cent of masses, stations, chord, speed and the other numbers would move the result");
  app.add_flag("--anyway", anyway, anyway_help);
  app.footer(effect_list() + "\nExample:\n  unrig fit --rig rig.toml dry_pluck.csv wet_pluck.csv step_a.csv -o fit.json");
  try {
    parse_command_line(app, argc, argv);
    std::erase_if(problem.profile, [](const std::string& name) { return name.empty() || name == "{}"; });  // how CLI11 says that nothing follows
    // Runs behind `--profile`.
    const auto files = std::stable_partition(problem.profile.begin(), problem.profile.end(), [](const std::string& name) {
      std::error_code none;
      return name == "all" || !std::filesystem::is_regular_file(name, none);
    });
    run_paths.insert(run_paths.end(), files, problem.profile.end());
    problem.profile.erase(files, problem.profile.end());
    if (run_paths.empty()) throw CLI::RequiredError("runs");
  } catch (const CLI::ParseError& e) {
    return app.exit(e) == 0 ? exit_done : exit_wrong_use;
  }

  std::vector<std::string> inputs = run_paths;
  inputs.push_back(rig_path);
  inputs.insert(inputs.end(), law_paths.begin(), law_paths.end());
  check_outputs({{"-o", output}}, inputs);
  check_given_once(run_paths);
  if (profile->count() > 0 && problem.profile.empty()) problem.profile = {"all"};
  problem.rig = read_rig(rig_path);
  try {
    problem.circulation = wagner_from_name(circulation);
  } catch (const std::invalid_argument& e) {
    throw InputError({"--wagner", 0}, e.what(), "wanted one of the names above", "");
  }
  for (const std::string& path : run_paths) problem.runs.push_back(read_run(path));
  check_recorded_once(problem.runs, problem.rig);
  problem.effects = effects_of_option("--effect", effect_ids);
  const std::vector<std::string> laws = add_laws(problem.rig, law_paths);
  problem.effects.insert(problem.effects.end(), laws.begin(), laws.end());
  for (const std::string& start : starts) {
    const std::size_t equals = start.find('=');
    const char* text = start.c_str() + (equals == std::string::npos ? 0 : equals + 1);
    char* end = nullptr;
    const double value = std::strtod(text, &end);
    if (equals == std::string::npos || end == text || *end != '\0')
      throw InputError({"--start", 0}, "'" + start + "'", "wanted NAME=VALUE", "Names are those of the report, values are in SI.");
    problem.start[start.substr(0, equals)] = value;
  }
  pass_the_gate(problem.rig, problem.runs, anyway);
  Progress progress;
  problem.progress = [&](const std::string& what) { progress(what); };
  FitResult result = fit(problem);
  const Provenance made = provenance_of(argc, argv);
  result.program = made.program;
  result.command = made.command;
  progress.clear();
  for (const std::string& warning : result.warnings) warn(warning);
  write_text(output, to_json(result, problem.rig.laws));
  fmt::print("{}", report(result, least));
  if (price && result.no_answer.empty()) fmt::print("{}", result.givens.empty() ? report(price_of_numbers(problem, result)) : "The price: uncertainties are stated, and are in the errors above.\n");
  const std::vector<Suspicion> suspect = implausible_parameters(result);
  tell(suspect);
  if (result.no_answer.empty()) return suspect.empty() || anyway ? exit_done : exit_no_answer;
  warn("no trustworthy answer: " + result.no_answer);
  return exit_no_answer;
}

}  // namespace unrig
