#include "core/import/import_command.h"

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include "core/files/command.h"
#include "core/files/command_line.h"
#include "core/files/error.h"
#include "core/rig/given_files.h"
#include "core/import/channel_list.h"
#include "core/import/import.h"
#include "core/files/text_file.h"

namespace unrig {

int import_command(int argc, char** argv) {
  CLI::App app{"Turns a laboratory's file into a run file: text of any delimiter, LabVIEW's .lvm, MATLAB 5 and 7.3, NI TDMS, universal file 58.", "unrig import"};
  std::string path, map, output;
  bool list = false;
  app.add_option("file", path, "the file; its format is told by its content")->required();
  app.add_option("--map", map, "mapping (TOML): which channel becomes which column, and what the run is");
  app.add_option("-o,--output", output, "run file (CSV)");
  app.add_flag("--list", list, "only list the file's channels: unit, rate, range, mean, noise; so it does without --map and -o");
  app.footer(
      "Example:\n  unrig import step.tdms\n  unrig import step.tdms --map map.toml -o step.csv\n\nwith a map.toml such as\n"
      "  unrig_import = 1\n  [run]\n  kind = \"step\"\n  medium = \"water\"\n  density = \"998.2 kg/m^3\"\n  speed = \"0.6 m/s\"\n  calibration = \"4.4 N/V\"\n"
      "  [time]                       # left out where the file gives the sampling of its channels\n  rate = \"500 Hz\"              # or: source = \"Time\", unit = \"s\" (time stamps of ISO 8601: no unit)\n"
      "  [[column]]\n  name = \"alpha\"\n  source = \"Rig/Angle\"         # as the list shows it\n  unit = \"deg\"                 # where the file gives none\n"
      "  [[column]]\n  name = \"gauge\"\n  source = \"Rig/Bridge\"\n  unit = \"V\"\n"
      "  # raw = true                 # takes unscaled converter counts, for a calibration in N per count\n"
      "  # bridge.kind = \"full-1\"     # volts to strain: quarter-1, quarter-2, half-1, half-2, full-1, full-2, full-3,\n"
      "  #                            # with bridge.gauge_factor, .poisson, .excitation, .initial_voltage, .gauge_resistance,\n"
      "  #                            # .lead_resistance, .shunt_gain (or .shunt_reading and .shunt_expected)\n"
      "  # [format]                   # of text, where it is not found out: delimiter = \";\", decimal = \",\", thousands = \".\",\n"
      "  #                            # missing = [\"ERR\", \"#N/A\"], skip_lines = 3, header = false");
  try {
    parse_command_line(app, argc, argv);
  } catch (const CLI::ParseError& e) {
    return app.exit(e) == 0 ? exit_done : exit_wrong_use;
  }
  list = list || (map.empty() && output.empty());
  if (!list && (map.empty() || output.empty())) throw InputError({path, 0}, "--map or --output is missing", "wanted both, or neither for a list of the channels", "`unrig import --help` shows an example.");
  if (!list) check_outputs({{"-o", output}}, {path, map});
  const std::string mapping = map.empty() ? "unrig_import = 1\n" : read_text(map);
  Progress progress;
  progress("reading " + path);
  const Recording recording = read_recording(path, mapping, map);
  if (list) {
    progress.clear();
    for (const std::string& warning : recording.warnings) warn(warning);
    fmt::print("{}", channel_list(recording));
    return exit_done;
  }
  progress("writing " + output);
  const Imported imported = import_recording(recording, mapping, map);
  write_text(output, imported.text);
  progress.clear();
  for (const std::string& warning : imported.warnings) warn(warning);
  fmt::print("{}: {} samples from {} ({})\n", output, imported.samples, recording.file, recording.format);
  for (const std::string& column : imported.columns) fmt::print("  {}\n", column);
  return exit_done;
}

}  // namespace unrig
