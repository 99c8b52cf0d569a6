#include "fit/check/implausible_parameters.h"

#include <fmt/format.h>

#include <cmath>
#include <filesystem>

namespace unrig {
namespace {

/// Of a beam rig's own parameters.
struct Plausible {
  Role role;
  double lowest, highest;
  const char* cause;  ///< what to look at
};

constexpr Plausible plausible[] = {
    {Role::stiffness, 0.1, 10, "unit or scale of the flexibility, or the clock of the runs?"},
    {Role::mass, 0.2, 4, "unit of the masses or of the chord, or the density of a run?"},
    {Role::damping, -0.5, 0.5, "a run that is none of this rig?"},
    {Role::slope, -12, 12, "unit of gauge or angle, or the speed?"},
};

}  // namespace

std::vector<Suspicion> implausible_parameters(const FitResult& result) {
  std::vector<Suspicion> found;
  for (const FittedParameter& p : result.parameters) {
    if (!p.identified || !p.effect.empty() || p.mode >= 0) continue;
    for (const Plausible& limits : plausible) {
      if (p.role != limits.role || (p.value >= limits.lowest && p.value <= limits.highest)) continue;
      const std::string where = p.run.empty() ? "all runs" : std::filesystem::path(p.run).filename().string();
      found.push_back({where, {limits.cause}, p.value / (p.value > limits.highest ? limits.highest : limits.lowest), 0, true,
                       fmt::format("{}: {} is fitted as {:.4g}{}, and plausible is {:g} to {:g}; {}", where, p.name, p.value, p.unit == "1" ? "" : " " + p.unit, limits.lowest, limits.highest, limits.cause)});
    }
  }
  return found;
}

}  // namespace unrig
