#include "fit/simulate/simulated_run.h"

#include <algorithm>

namespace unrig {
namespace {

constexpr std::string_view remark = "# # ", simulated = "simulated with the rig ", of = "simulated from the run ";

}  // namespace

std::vector<std::string> SimulatedRun::remarks() const {
  std::vector<std::string> lines = recipe;
  lines.insert(lines.begin() + 1, std::string(of) + of_run);
  if (const std::string made = made_by.column(); !made.empty()) lines.insert(lines.begin() + 2, made);
  return lines;
}

std::optional<SimulatedRun> simulated_run(std::string_view text) {
  SimulatedRun run;
  while (text.starts_with('#')) {
    std::string_view line = text.substr(0, text.find('\n'));
    text.remove_prefix(std::min(text.size(), line.size() + 1));
    if (line.ends_with('\r')) line.remove_suffix(1);
    if (!line.starts_with(remark)) continue;
    line.remove_prefix(remark.size());
    if (line.starts_with(of))
      run.of_run = line.substr(of.size());
    else if (line.starts_with(MadeBy::prefix))
      run.made_by = MadeBy::of_column(line.substr(MadeBy::prefix.size()));
    else
      run.recipe.emplace_back(line);
  }
  if (run.recipe.empty() || !run.recipe.front().starts_with(simulated)) return std::nullopt;
  return run;
}

}  // namespace unrig
