#include "fit/search/no_worse_than_start.h"

#include <fmt/format.h>

#include "fit/uncertainty/undetermined.h"

namespace unrig {

std::string no_worse_than_start(Arrival& arrival, const FitProblem& problem) {
  Arrival other = arrival;
  for (Unknown& u : other.joint.unknowns()) u.value = start_of(other.joint.parameter(u), problem.start);
  const double reached = arrival.joint.chi2(), at_start = other.joint.chi2();
  if (!(at_start < reached)) return "";
  solve(other);
  arrival = std::move(other);
  return fmt::format("The search ended at a chi-square of {:.4g}, above that of the start values, {:.4g}. These numbers come from another one that began there and ended at {:.4g}.", reached, at_start,
                     arrival.joint.chi2());
}

}  // namespace unrig
