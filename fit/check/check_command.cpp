#include "fit/check/check_command.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

#include "core/check/gate.h"
#include "core/check/run_estimate.h"
#include "core/files/command.h"
#include "core/files/command_line.h"

namespace unrig {

int check_command(int argc, char** argv) {
  CLI::App app{"Are rig file and recordings plausible, and what can they determine?", "unrig check"};
  std::string rig_path, output;
  std::vector<std::string> run_paths;
  app.add_option("--rig", rig_path, "rig file (TOML)")->required();
  app.add_option("runs", run_paths, "run files (CSV) of this rig");
  app.add_option("-o,--output", output, "the numbers (JSON)");
  try {
    parse_command_line(app, argc, argv);
  } catch (const CLI::ParseError& e) {
    return app.exit(e) == 0 ? exit_done : exit_wrong_use;
  }
  const Rig rig = read_rig(rig_path);
  const CheckModel model(rig);
  std::vector<Run> runs;
  double reference = 99;
  for (const std::string& path : run_paths) {
    runs.push_back(read_run(path));
    if (runs.back().kind == RunKind::pluck) { const double k = estimate(model, runs.back()).stiffness; if (std::abs(k) < std::abs(reference)) reference = k; }
  }
  if (reference == 99) reference = 0;
  for (const Suspicion& s : suspicions(rig, runs)) fmt::print(stderr, "check: {}  [{:.1f}]\n", s.text, s.weight);
  for (const Run& run : runs) {
    const std::string& path = run.file;
    const RunEstimate e = estimate(model, run, reference);
    fmt::print("{} line {:.4f} modelled {:.4f} share {:.3f} k {:.3f} steady {:.3f}{} ring {:.3f} phase {:.2f} onset {:.2f} step {:.2f} load {:.3f}\n", path, e.line, e.modelled, e.fluid_share, e.stiffness, e.steady, e.reversed ? "R" : "", e.ring, e.ring_phase, e.onset * 57.3, e.step * 57.3, e.load_change);
    for (const Channel& c : run.channels) if (c.bad + c.clipped > 0) fmt::print("BAD {} {} bad {} clipped {}\n", path, c.name, c.bad, c.clipped);
  }
  return exit_done;
}

}  // namespace unrig
