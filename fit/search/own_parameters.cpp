#include "fit/search/own_parameters.h"

#include <algorithm>
#include <utility>

#include "core/numerics/in_parallel.h"
#include "fit/search/find_motion.h"
#include "fit/search/left_of_runs.h"

namespace unrig {
namespace {

constexpr double to_the_noise = 1.02;  // reduced chi-square: one per cent of it is chance in a few thousand samples

double to_the_noise_of(const RunResidual& run) { return to_the_noise * static_cast<double>(run.degrees_of_freedom()); }

/// Searches the own parameters of the one run of `alone`; `from_afar`: its motion first, as smooth as the angle shows it.
void search_alone(JointProblem& alone, bool from_afar) {
  JointProblem::SolveOptions options;
  options.iterations = 4;
  options.tolerance = 1e-2;
  options.precision = 0.5;
  options.most_evaluations = 12;
  options.enough = to_the_noise;
  RunResidual& run = alone.runs().front();
  if (!from_afar) alone.solve(options);
  else if (run.takes_small_steps(alone.theta(0))) find_motion(run, alone.theta(0), true);
  else lead_in(run, alone.theta(0), [&] { alone.solve(options); });
}

/// One run of a joint problem, its own parameters searched: from where they stand, then with the motion from afar, then, where the rig's own have gone astray, from where the rig file has them.
JointProblem fitted_alone(const JointProblem& joint, std::size_t r) {
  JointProblem there = joint.part({r});
  for (Unknown& u : there.unknowns()) u.held = u.held || u.run < 0;
  there.runs().front().temper(1);
  JointProblem best = there;
  const double enough = to_the_noise_of(best.runs().front());
  double least = best.chi2();
  const auto is_better = [&](JointProblem& other) {
    const double left = other.chi2();
    if (!(left < least)) return false;
    least = left;
    best = std::move(other);
    return true;
  };
  constexpr int rounds = 2;
  for (int round = 0; round < rounds; ++round) {
    JointProblem here = best;
    search_alone(here, false);
    is_better(here);
    if (least < enough) return best;
    JointProblem afar = best;
    search_alone(afar, true);
    if (!is_better(afar)) break;
  }
  if (least < enough) return best;
  const Eigen::VectorXd start = there.model().start_values();
  bool any = false;
  for (Unknown& u : there.unknowns()) {
    constexpr double astray = 2;
    const bool near = u.value > start[u.parameter] / astray && u.value < astray * start[u.parameter];
    if (u.held || near || !there.parameter(u).effect.empty()) continue;
    u.value = start[u.parameter];
    any = true;
  }
  if (!any) return best;
  search_alone(there, true);
  search_alone(there, false);
  is_better(there);
  return best;
}

}  // namespace

void fit_own_parameters(JointProblem& joint, double astray) {
  const std::vector<LeftOfRun> left = astray > 0 ? left_of_runs(joint) : std::vector<LeftOfRun>();
  in_parallel(joint.runs().size(), [&](std::size_t r) {
    const auto is_own = [&](const Unknown& u) { return !u.held && u.run == static_cast<int>(r); };
    if (astray > 0 && !(left[r].variance > astray)) return;
    if (joint.runs()[r].is_aside() || joint.runs()[r].motion().unknowns() == 0 || std::none_of(joint.unknowns().begin(), joint.unknowns().end(), is_own)) return;
    const JointProblem alone = fitted_alone(joint, r);
    for (Unknown& u : joint.unknowns()) {
      if (!is_own(u)) continue;
      for (const Unknown& known : alone.unknowns())
        if (known.run == 0 && known.parameter == u.parameter) u.value = known.value;
    }
    const double tempered = joint.runs()[r].tempered();
    joint.runs()[r] = alone.runs().front();
    joint.runs()[r].temper(tempered);
  });
}

}  // namespace unrig
