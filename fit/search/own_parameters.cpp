#include "fit/search/own_parameters.h"

#include <algorithm>
#include <utility>

#include "core/numerics/in_parallel.h"
#include "fit/search/find_motion.h"

namespace unrig {
namespace {

constexpr double to_the_noise = 1.02;  // reduced chi-square: one per cent of it is chance in a few thousand samples

/// One run of a joint problem, its own parameters searched.
JointProblem fitted_alone(const JointProblem& joint, std::size_t r) {
  JointProblem alone = joint.part({r});
  for (Unknown& u : alone.unknowns()) u.held = u.held || u.run < 0;
  alone.runs().front().temper(1);
  JointProblem::SolveOptions options;
  options.iterations = 4;
  options.tolerance = 1e-2;
  options.precision = 0.5;
  options.most_evaluations = 12;
  options.enough = to_the_noise;
  const double enough = to_the_noise * static_cast<double>(alone.runs().front().degrees_of_freedom());
  constexpr int rounds = 2;
  for (int round = 0; round < rounds; ++round) {
    alone.solve(options);
    if (alone.chi2() < enough) break;
    JointProblem other = alone;  // the motion once more from afar
    if (RunResidual& run = other.runs().front(); run.takes_small_steps(other.theta(0))) find_motion(run, other.theta(0), true);
    else lead_in(run, other.theta(0), [&] { other.solve(options); });
    if (!(other.chi2() < alone.chi2())) break;
    alone = std::move(other);
  }
  return alone;
}

}  // namespace

void fit_own_parameters(JointProblem& joint) {
  in_parallel(joint.runs().size(), [&](std::size_t r) {
    const auto is_own = [&](const Unknown& u) { return !u.held && u.run == static_cast<int>(r); };
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
