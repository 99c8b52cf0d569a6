#include <cstdio>
#include <cstring>
#include <exception>

#include "core/command.h"
#include "core/error.h"
#include "core/import/import_command.h"
#include "correct/correct_command.h"
#include "correct/report/report_command.h"
#include "fit/apparent_mass_command.h"
#include "fit/diagnose/collect_command.h"
#include "fit/diagnose/diagnose_command.h"
#include "fit/diagnose/trial_command.h"
#include "fit/fit_command.h"
#include "fit/simulate_command.h"

namespace {

constexpr unrig::Command commands[] = {
    {"import", "turn a laboratory's file (text, MATLAB, TDMS, universal file) into a run file", unrig::import_command},
    {"simulate", "simulate what gauge and sensors of a rig read in a run", unrig::simulate_command},
    {"fit", "fit stiffness, damping and apparent mass of a rig to recordings", unrig::fit_command},
    {"apparent-mass", "apparent mass of the fluid from the frequencies of a dry and a wet free decay", unrig::apparent_mass_command},
    {"diagnose", "where recordings and model differ, and which physics was left out", unrig::diagnose_command},
    {"trial", "how often diagnose finds what was hidden in simulated campaigns", unrig::trial_command},
    {"collect", "put the shards of a trial together", unrig::collect_command},
    {"correct", "take the rig out of a gauge record: rigid-rig load and indicial response", unrig::correct_command},
    {"report", "show results as one HTML file: traces, residuals, spectra, parameters", unrig::report_command},
};

void print_help(std::FILE* stream) {
  std::fputs("unrig: take the rig out of the reading\n\nusage: unrig COMMAND [OPTIONS]\n\n", stream);
  for (const unrig::Command& command : commands) std::fprintf(stream, "  %-14s %s\n", command.name, command.summary);
  std::fputs(R"(
`unrig COMMAND --help` explains a command. Exit status: 0 done, 1 no trustworthy answer, 2 wrong use or unusable input.

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
A rig file holds its section, masses, flexibilities and gauge, or only its modes:
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

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2) {
    print_help(stderr);
    return unrig::exit_wrong_use;
  }
  if (std::strcmp(argv[1], "--help") == 0 || std::strcmp(argv[1], "-h") == 0) {
    print_help(stdout);
    return unrig::exit_done;
  }
  if (std::strcmp(argv[1], "--version") == 0) {
    std::puts("unrig " UNRIG_VERSION);
    return unrig::exit_done;
  }
  for (const unrig::Command& command : commands) {
    if (std::strcmp(argv[1], command.name) != 0) continue;
    try {
      return command.run(argc - 1, argv + 1);
    } catch (const unrig::InputError& e) {
      std::fprintf(stderr, "unrig %s: %s\n", command.name, e.what());
      return unrig::exit_wrong_use;
    } catch (const unrig::NoAnswer& e) {
      std::fprintf(stderr, "unrig %s: %s\n", command.name, e.what());
      return unrig::exit_no_answer;
    } catch (const std::exception& e) {
      std::fprintf(stderr, "unrig %s: internal error: %s\n", command.name, e.what());
      return unrig::exit_no_answer;
    }
  }
  std::fprintf(stderr, "unrig: no command '%s'\n\n", argv[1]);
  print_help(stderr);
  return unrig::exit_wrong_use;
}
