#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <iterator>
#include <string>
#include <system_error>
#include <vector>

#include "core/files/command.h"
#include "core/files/near_word.h"
#include "core/files/run_command.h"
#include "core/files/text_file.h"
#include "core/files/verbosity.h"
#include "core/import/import_command.h"
#include "core/new/new_command.h"
#include "correct/batch/batch_command.h"
#include "correct/batch/collect_command.h"
#include "correct/correct_command.h"
#include "correct/report/report_command.h"
#include "fit/apparent_mass/apparent_mass_command.h"
#include "fit/check/check_command.h"
#include "fit/diagnose/diagnose_command.h"
#include "fit/trial/trial_command.h"
#include "fit/fit_command.h"
#include "fit/propose/propose_command.h"
#include "fit/simulate/simulate_command.h"
#ifdef UNRIG_MPI
#include "correct/mpi/ranks_of_mpi.h"
#endif

namespace {

constexpr unrig::Command commands[] = {
    {"new", "write a rig or run file to begin with: an example with remarks and questions", unrig::new_command},
    {"import", "turn a laboratory's file (text, MATLAB, TDMS, universal file) into a run file", unrig::import_command},
    {"check", "are rig file and recordings plausible, and what can they determine", unrig::check_command},
    {"simulate", "simulate what gauge and sensors of a rig read in a run", unrig::simulate_command},
    {"fit", "fit stiffness, damping and apparent mass of a rig to recordings", unrig::fit_command},
    {"apparent-mass", "apparent mass of the fluid from the frequencies of a dry and a wet free decay", unrig::apparent_mass_command},
    {"diagnose", "where recordings and model differ, and which physics was left out", unrig::diagnose_command},
    {"propose", "which run to record next: the one that decides between explanations of a diagnosis", unrig::propose_command},
    {"trial", "how often diagnose finds what was hidden in simulated campaigns", unrig::trial_command},
    {"correct", "take the rig out of a gauge record: rigid-rig load and indicial response", unrig::correct_command},
    {"batch", "check, fit, correct and diagnose many campaigns: one table with a row for each run", unrig::batch_command},
    {"collect", "put the shards of a trial or a batch together", unrig::collect_command},
    {"report", "show results as one HTML file: traces, residuals, spectra, parameters", unrig::report_command},
};

void print_help(std::FILE* stream) {
  std::fputs("unrig: take the rig out of the reading\n\nusage: unrig COMMAND [OPTIONS]\n\n", stream);
  for (const unrig::Command& command : commands) std::fprintf(stream, "  %-14s %s\n", command.name, command.summary);
  std::fputs(R"(
`unrig help COMMAND` explains a command. With every command: --quiet (no summary, warnings or progress), --verbose (every step a line), --json
(what -o writes on standard output too, in place of the summary). Exit status: 0 done, 1 no trustworthy answer, 2 wrong use or unusable input.

From the recordings of one rig to a page to look at:
    unrig fit      --rig rig.toml dry_pluck.csv wet_pluck.csv step_a.csv -o fit.json
    unrig diagnose --rig rig.toml dry_pluck.csv wet_pluck.csv step_a.csv -o diagnosis.json
    unrig correct  --rig rig.toml --fit fit.json step_a.csv -o corrected.csv --indicial indicial.csv
    unrig report   fit.json diagnosis.json corrected.csv indicial.csv -o report.html

A recording (run file) says what it is before its columns; `unrig import` makes one of other formats:
    # unrig_run = 1
    # kind = "step"                # or "pluck" (free decay), "forced" (measured force), "moved" (measured motion of the mount)
    # density = "998.2 kg/m^3"
    # speed = "0.6 m/s"            # free stream, 0 in a still tank
    time [s],alpha [deg],gauge [N]
    0.000,2.076,6.857
A rig file holds its section, masses, stiffness and gauge, or only its modes; `unrig new rig` writes one to begin with:
    unrig_rig = 1
    name = "oscillator"
    [[modal]]
    mass = "1 kg"
    frequency = "7.7 Hz"
    damping_ratio = 0.01
    gauge_gain = "1000 N/m"        # reading per unit of modal displacement
sample_data/campaigns/null has complete ones of a tow-tank rig (once installed: share/doc/unrig/null). Every value has its unit, any that UDUNITS-2 knows.
The manual, with every key, column and verdict: correct/manual (once installed: share/doc/unrig/manual).
)", stream);
}

/// Runs a command without the options that are every command's: what of them is asked for is done here.
int run_as_told(const unrig::Command& command, int argc, char** argv) {
  bool quiet = false, as_json = false;
  std::string output;
  std::vector<char*> words;
  for (int i = 0; i < argc; ++i) {
    const std::string word = argv[i];
    if (word == "--quiet") quiet = true;
    else if (word == "--verbose") unrig::set_verbosity(unrig::Verbosity::verbose);
    else if (word == "--json") as_json = true;
    else words.push_back(argv[i]);
    if ((word == "-o" || word == "--output") && i + 1 < argc) output = argv[i + 1];
    if (word.starts_with("-o") && word.size() > 2) output = word.substr(2);
    if (word.starts_with("--output=")) output = word.substr(std::string("--output=").size());
  }
  if (quiet) unrig::set_verbosity(unrig::Verbosity::quiet);
  if (as_json && !output.ends_with(".json")) {
    std::fprintf(stderr, "unrig %s: --json with %s; wanted -o FILE.json: of a result in columns give the file\n", command.name, output.empty() ? "no -o" : ("-o " + output).c_str());
    return unrig::exit_wrong_use;
  }
  const auto count = static_cast<int>(words.size());
  words.push_back(nullptr);
  if (!quiet && !as_json) return run_command(command, count, words.data());
  const auto written = [&] {
    std::error_code none;
    return std::filesystem::last_write_time(output, none);
  };
  const auto before = written();
  std::fflush(stdout);
  const int out = dup(STDOUT_FILENO), nowhere = open("/dev/null", O_WRONLY);
  dup2(nowhere, STDOUT_FILENO);
  close(nowhere);
  const int status = run_command(command, count, words.data());
  std::fflush(stdout);
  dup2(out, STDOUT_FILENO);
  close(out);
  if (as_json && std::filesystem::exists(output) && written() != before) {
    const std::string text = unrig::read_text(output);
    std::fwrite(text.data(), 1, text.size(), stdout);
  }
  return status;
}

const unrig::Command* command_called(const std::string& name) {
  const auto found = std::find_if(std::begin(commands), std::end(commands), [&](const unrig::Command& command) { return name == command.name; });
  return found == std::end(commands) ? nullptr : found;
}

int no_such_command(const std::string& name) {
  std::vector<std::string> names{"help"};
  for (const unrig::Command& command : commands) names.emplace_back(command.name);
  const std::string meant = unrig::nearest_word(name, names);
  std::fprintf(stderr, "unrig: no command '%s'%s\n`unrig help` lists the commands.\n", name.c_str(), meant.empty() ? "" : ("; did you mean " + meant + "?").c_str());
  return unrig::exit_wrong_use;
}

/// `unrig help` and `unrig help COMMAND`.
int help(int argc, char** argv) {
  if (argc < 3) {
    print_help(stdout);
    return unrig::exit_done;
  }
  const unrig::Command* const command = command_called(argv[2]);
  if (!command) return no_such_command(argv[2]);
  std::string option = "--help";
  char* words[] = {argv[2], option.data(), nullptr};
  return run_command(*command, 2, words);
}

}  // namespace

int main(int argc, char** argv) {
#ifdef UNRIG_MPI
  unrig::RanksOfMpi ranks;
  unrig::set_hand_out([&](std::size_t count) { return ranks.share(count); });
#endif
  if (argc < 2) {
    print_help(stderr);
    return unrig::exit_wrong_use;
  }
  const std::string first = argv[1];
  if (first == "--help" || first == "-h" || first == "help") return help(first == "help" ? argc : 1, argv);
  if (first == "--version" || first == "-v" || first == "-V") {
    std::puts("unrig " UNRIG_VERSION);
    return unrig::exit_done;
  }
  if (const unrig::Command* const command = command_called(first)) return run_as_told(*command, argc - 1, argv + 1);
  return no_such_command(first);
}
