#include "correct/estimate/noise_choice.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

using Colours = RunResidual::Colours;

bool any(const Colours& colours) {
  return std::any_of(colours.begin(), colours.end(), [](const auto& colour) { return colour.has_value(); });
}

/// The slowest power follows from the one before it.
double cost_of(const Colours& colours, Index readings) {
  Index powers = 0;
  for (const auto& colour : colours) powers += colour ? colour->power.size() - 1 : 0;
  return static_cast<double>(powers) * std::log(static_cast<double>(readings));
}

}  // namespace

void choose_colour(RunInLegs& legs, Search& search, const std::vector<ChannelColour>& expected, double enough) {
  const bool has_laws = legs.size() == 1 && legs.residual(0).largest_arguments(search.solution.theta).size() > 0;  // each look at another colour is a search of its own
  if (legs.size() > 1 || has_laws || !legs.residual(0).may_be_coloured()) return;
  const RunInLegs white = legs;
  const Index readings = white.residual(0).observations();
  double surprise = minus_twice_log_evidence(white.residual(0), search);
  const auto consider = [&](const Colours& colours, double charge) {
    const VectorXd from = search.solution.theta;
    RunInLegs coloured = white.with_colours(from, colours);
    Search other = minimise(searched(coloured), search.prior, from, enough, true);
    const double its = minus_twice_log_evidence(coloured.residual(0), other) + charge;
    if (!(its < surprise)) return false;
    surprise = its;
    search = std::move(other);
    legs = std::move(coloured);
    return true;
  };
  if (!expected.empty())
    if (const Colours common = white.residual(0).colours(search.solution.theta, expected); any(common)) consider(common, 0);
  const auto consider_its_own = [&] {
    const Colours own = legs.residual(0).colours(search.solution.theta, {});
    return any(own) && consider(own, cost_of(own, readings));
  };
  if (consider_its_own()) consider_its_own();  // offset and load took less of the slow noise when it was known for noise
}

}  // namespace unrig
