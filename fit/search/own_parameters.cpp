#include "fit/search/own_parameters.h"

#include <algorithm>
#include <utility>

#include "core/numerics/in_parallel.h"
#include "fit/likelihood/explained.h"
#include "fit/search/find_motion.h"
#include "fit/search/left_of_runs.h"
#include "fit/search/search_numbers.h"

namespace unrig {
namespace {

/// Searches the own parameters of the one run of `alone` and its motion; then, as long as that helps, with the motion once more from afar.
void search_alone(JointProblem& alone) {
  JointProblem::SolveOptions options;
  options.iterations = 4;
  options.tolerance = 1e-2;
  options.precision = 0.5;
  options.most_evaluations = 12;
  const Eigen::Index freedom = alone.runs().front().degrees_of_freedom();
  options.enough = alone.runs().front().colour(0) ? most_of_noise(freedom) : to_the_noise;  // the size of a colour is that of other runs
  const double enough = options.enough * static_cast<double>(freedom);
  constexpr int rounds = 2;
  for (int round = 0; round < rounds && !(alone.chi2() < enough); ++round) {
    if (JointProblem tried = alone; tried.solve(options), tried.chi2() < alone.chi2()) alone = std::move(tried);  // under a law with corners a search for c may lose its way at the next theta
    if (alone.chi2() < enough) break;
    JointProblem other = alone;
    if (RunResidual& run = other.runs().front(); run.takes_small_steps(other.theta(0))) find_motion(run, other.theta(0), true);
    else lead_in(run, other.theta(0), [&] { other.solve(options); });
    if (!(other.chi2() < alone.chi2())) break;
    alone = std::move(other);
  }
}

/// Whether the rig's own parameters have gone astray; then they are back where the rig file has them.
bool start_at_the_rig(JointProblem& alone) {
  constexpr double astray = 2;
  const Eigen::VectorXd start = alone.model().start_values();
  bool any = false;
  for (Unknown& u : alone.unknowns()) {
    const bool near = u.value > start[u.parameter] / astray && u.value < astray * start[u.parameter];
    if (u.held || near || !alone.parameter(u).effect.empty()) continue;
    u.value = start[u.parameter];
    any = true;
  }
  return any;
}

/// One run of a joint problem, its own parameters searched: from where they stand and, where that ends far from the noise and they had gone astray, from where the rig file has them.
JointProblem fitted_alone(const JointProblem& joint, std::size_t r) {
  JointProblem there = joint.part({r});
  for (Unknown& u : there.unknowns()) u.held = u.held || u.run < 0;
  there.runs().front().temper(1);
  JointProblem alone = there;
  search_alone(alone);
  const bool dear = there.runs().front().takes_small_steps(there.theta(0));  // a search under a gap goes from afar as it is
  if (dear || alone.chi2() < nearly_explained * static_cast<double>(alone.runs().front().degrees_of_freedom()) || !start_at_the_rig(there)) return alone;
  search_alone(there);
  return there.chi2() < alone.chi2() ? there : alone;
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
