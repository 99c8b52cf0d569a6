#include "fit/apparent_mass/apparent_mass_command.h"

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include "core/files/command.h"
#include "core/files/command_line.h"
#include "core/rig/given_files.h"
#include "core/files/provenance.h"
#include "core/files/text_file.h"
#include "fit/apparent_mass/apparent_mass.h"
#include "fit/apparent_mass/apparent_mass_files.h"

namespace unrig {

int apparent_mass_command(int argc, char** argv) {
  CLI::App app{"Apparent mass of the fluid from the frequency shift between two free decays, in air and in the fluid.", "unrig apparent-mass"};
  std::string rig_path, dry_path, wet_path, output;
  bool no_joint_fit = false;
  app.add_option("--rig", rig_path, "rig file (TOML)")->required();
  app.add_option("--dry", dry_path, "free decay in air (CSV)")->required();
  app.add_option("--wet", wet_path, "free decay in the still fluid (CSV)")->required();
  app.add_option("-o,--output", output, "result (JSON)")->required();
  app.add_flag("--no-joint-fit", no_joint_fit, "do not fit the whole coupled model to both decays for comparison");
  app.footer("Example:\n  unrig apparent-mass --rig rig.toml --dry dry_pluck.csv --wet wet_pluck.csv -o apparent.json");
  try {
    parse_command_line(app, argc, argv);
  } catch (const CLI::ParseError& e) {
    return app.exit(e) == 0 ? exit_done : exit_wrong_use;
  }

  check_outputs({{"-o", output}}, {rig_path, dry_path, wet_path});
  ApparentMassProblem problem;
  problem.rig = read_rig(rig_path);
  problem.dry = read_run(dry_path);
  problem.wet = read_run(wet_path);
  problem.joint_fit = !no_joint_fit;
  Progress progress;
  problem.progress = [&](const std::string& what) { progress(what); };
  const ApparentMassResult result = apparent_mass(problem);
  progress.clear();
  for (const std::string& warning : result.warnings) warn(warning);
  write_text(output, to_json(result, provenance_of(argc, argv)));
  fmt::print("{}", report(result));
  return exit_done;
}

}  // namespace unrig
