#include "core/import/import_command.h"

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include "core/files/command.h"
#include "core/files/command_line.h"
#include "core/files/error.h"
#include "core/rig/given_files.h"
#include "core/import/channel_list.h"
#include "core/import/import.h"
#include "core/import/import_template.h"
#include "core/files/questions.h"
#include "core/files/text_file.h"
#include "core/files/together.h"

namespace unrig {

namespace {

namespace fs = std::filesystem;

struct Options {
  std::vector<std::string> files, settings;
  std::string map, output;
  bool list = false, as_template = false, force = false;
};

/// Where the run of a file goes: into the file of `-o`, or by its own name into that folder.
std::string run_path(const Options& options, const std::string& file) {
  const bool folder = options.output.ends_with('/') || fs::is_directory(options.output);
  if (!folder && options.files.size() == 1) return options.output;
  if (!folder) throw InputError({options.output, 0}, fmt::format("-o is one file for {} recordings", options.files.size()), "wanted a folder that is there, or a name that ends with /", "");
  return (fs::path(options.output) / (fs::path(file).stem().string() + ".csv")).string();
}

/// The folder of `-o`, made where it is not there yet.
void make_folder(const std::string& output) {
  std::error_code failure;
  if (output.ends_with('/')) fs::create_directories(output, failure);
  if (failure) throw InputError({output, 0}, "the folder cannot be made: " + failure.message(), "wanted a folder that may be written to", "");
}

std::vector<std::string> run_paths(const Options& options) {
  std::vector<std::string> paths;
  for (const std::string& file : options.files) {
    const std::string path = run_path(options, file);
    if (const auto same = std::find(paths.begin(), paths.end(), path); same != paths.end())
      throw InputError({file, 0}, fmt::format("its run would go to {}, and so would that of {}", path, options.files[static_cast<std::size_t>(same - paths.begin())]), "wanted files of different names", "Import one of them alone.");
    paths.push_back(path);
  }
  return paths;
}

int list_channels(const Options& options, const std::string& mapping) {
  for (const std::string& file : options.files) {
    Progress progress;
    progress("reading " + file);
    const Recording recording = read_recording(file, mapping, options.map);
    progress.clear();
    for (const std::string& warning : recording.warnings) warn(warning);
    fmt::print("{}", channel_list(recording));
  }
  return exit_done;
}

int write_template(const Options& options) {
  if (options.files.size() != 1 || !options.map.empty() || !options.settings.empty())
    throw InputError({"--template", 0}, options.files.size() != 1 ? "more than one recording" : options.map.empty() ? "--set beside it" : "--map beside it", "wanted one recording alone: it writes the mapping", "Files of one logger share a mapping.");
  refuse_overwriting(options.output, options.force);
  const Recording recording = read_recording(options.files.front(), "unrig_import = 1\n", "");
  for (const std::string& warning : recording.warnings) warn(warning);
  const std::string text = import_template(recording);
  if (options.output.empty()) {
    std::fwrite(text.data(), 1, text.size(), stdout);
    return exit_done;
  }
  write_text(options.output, text);
  fmt::print("{}: a mapping that imports as it stands, with {} questions to you (lines that begin with \"# ?\")\nthen:  unrig import {} --map {} -o run.csv\n", options.output, questions_in(text), options.files.front(), options.output);
  return exit_done;
}

int import_all(const Options& options, const std::string& mapping) {
  std::vector<RunSetting> settings;
  for (const std::string& setting : options.settings) settings.push_back(run_setting(setting));
  const std::vector<std::string> paths = run_paths(options);
  make_folder(options.output);
  std::vector<Output> outputs;
  for (std::size_t i = 0; i < paths.size(); ++i) outputs.push_back({i == 0 ? "-o" : fmt::format("-o ({})", options.files[i]), paths[i]});
  std::vector<std::string> inputs = options.files;
  inputs.push_back(options.map);
  check_outputs(outputs, inputs);
  Progress progress;
  std::vector<TextFile> files;
  std::string told;
  for (std::size_t i = 0; i < paths.size(); ++i) {
    progress("reading " + options.files[i]);
    const Recording recording = read_recording(options.files[i], mapping, options.map);
    Imported imported = import_recording(recording, mapping, options.map, settings);
    for (const std::string& warning : imported.warnings) warn(warning);
    told += fmt::format("{}: {} samples from {} ({})\n", paths[i], imported.samples, recording.file, recording.format);
    for (const std::string& column : imported.columns) told += fmt::format("  {}\n", column);
    files.push_back({paths[i], [text = std::move(imported.text)](const TextSink& sink) { sink(text); }});
  }
  write_together(files);
  progress.clear();
  fmt::print("{}", told);
  return exit_done;
}

}  // namespace

int import_command(int argc, char** argv) {
  CLI::App app{"Turns a laboratory's file into a run file: text of any delimiter, LabVIEW's .lvm, MATLAB 5 and 7.3, NI TDMS, universal file 58.", "unrig import"};
  Options options;
  app.add_option("files", options.files, "the file, or several of one logger; the format is told by the content")->required();
  app.add_option("--map", options.map, "mapping (TOML): which channel becomes which column, and what the run is");
  app.add_option("--set", options.settings, "KEY=VALUE of the run file's head, such as speed=\"0.6 m/s\", in place of what the mapping says; may be repeated")->allow_extra_args(false);
  app.add_option("-o,--output", options.output, "run file (CSV); of several files a folder");
  app.add_flag("--template", options.as_template, "write a mapping for this file, to be edited: to -o, or to standard output");
  app.add_flag("--force", options.force, "let --template write over a file that is there");
  app.add_flag("--list", options.list, "only list the file's channels: unit, rate, range, mean, noise; so it does without --map and -o");
  app.footer(
      "Example:\n  unrig import step.tdms\n  unrig import step.tdms --template -o map.toml\n  unrig import step.tdms --map map.toml -o step.csv\n  unrig import slow_1.tdms slow_2.tdms --map map.toml --set speed=\"0.3 m/s\" -o runs/\n\nwith a map.toml such as\n"
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
  if (options.as_template) return write_template(options);
  options.list = options.list || (options.map.empty() && options.output.empty() && options.settings.empty());
  if (!options.list && (options.map.empty() || options.output.empty()))
    throw InputError({options.files.front(), 0}, "--map or --output is missing", "wanted both, or neither for a list of the channels", "`unrig import FILE --template -o map.toml` writes a mapping to begin with.");
  const std::string mapping = options.map.empty() ? "unrig_import = 1\n" : read_text(options.map);
  return options.list ? list_channels(options, mapping) : import_all(options, mapping);
}

}  // namespace unrig
