#include <cstdio>
#include <cstring>
#include <exception>

#include "core/command.h"
#include "core/error.h"
#include "core/import/import_command.h"
#include "correct/correct_command.h"
#include "correct/report/report_command.h"
#include "fit/apparent_mass_command.h"
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
    {"correct", "take the rig out of a gauge record: rigid-rig load and indicial response", unrig::correct_command},
    {"report", "show results as one HTML file: traces, residuals, spectra, parameters", unrig::report_command},
};

void print_help(std::FILE* stream) {
  std::fputs("unrig: take the rig out of the reading\n\nusage: unrig COMMAND [OPTIONS]\n\n", stream);
  for (const unrig::Command& command : commands) std::fprintf(stream, "  %-14s %s\n", command.name, command.summary);
  std::fputs("\n`unrig COMMAND --help` explains a command. Exit status: 0 done, 1 no trustworthy answer, 2 wrong use or unusable input.\n", stream);
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
