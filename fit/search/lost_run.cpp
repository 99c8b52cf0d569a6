#include "fit/search/lost_run.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>
#include <utility>
#include <vector>

#include "fit/search/find_motion.h"
#include "fit/uncertainty/undetermined.h"

namespace unrig {
namespace {

/// Searches c of a run from afar at its theta: from where it stands, and from what is known of no trajectory.
void follow_from_afar(Trial& trial, std::size_t lost) {
  JointProblem& joint = trial.arrival.joint;
  const RunResidual before = joint.runs()[lost];
  RunResidual anew(joint.model(), before.run(), trial.arrival.windows[lost]);
  anew.keep_noise_of(before);
  anew.follow_in(before.finer());
  double least = INFINITY;
  RunResidual best = before;
  for (const RunResidual& start : {before, anew})
    for (const bool thoroughly : {false, true}) {
      joint.runs()[lost] = start;
      find_motion(joint.runs()[lost], joint.theta(lost), thoroughly);
      if (const double left = joint.part({lost}).chi2(); left < least) least = left, best = joint.runs()[lost];
    }
  joint.runs()[lost] = std::move(best);
}

/// The fit with theta as all runs but one have it, and that one followed from afar; none where it is the only one.
std::optional<Trial> followed_by_the_others(const Trial& trial, std::size_t lost) {
  const JointProblem& all = trial.arrival.joint;
  std::vector<std::size_t> others;
  for (std::size_t r = 0; r < all.runs().size(); ++r)
    if (r != lost && !all.runs()[r].is_aside()) others.push_back(r);
  if (others.empty()) return {};
  JointProblem without = all.part(others);
  hold_undetermined(without);
  JointProblem::SolveOptions options;
  options.iterations = 8;
  options.tolerance = 1e-3;
  options.precision = 0.5;
  options.most_evaluations = 12;
  without.solve(options);
  Trial again = trial;
  JointProblem& joint = again.arrival.joint;
  for (std::size_t k = 0; k < others.size(); ++k) joint.runs()[others[k]] = without.runs()[k];
  for (Unknown& u : joint.unknowns())
    for (const Unknown& known : without.unknowns()) {
      const bool same_run = known.run < 0 ? u.run < 0 : u.run == static_cast<int>(others[static_cast<std::size_t>(known.run)]);
      if (same_run && known.parameter == u.parameter) u.value = known.value;
    }
  joint.runs()[lost].temper(1);  // as it is to be followed
  measure(again);                // a search may have ended with a step that was not taken: every run at this theta
  follow_from_afar(again, lost);
  fit_fully(again, 2);
  return again;
}

}  // namespace

Trial with_lost_runs_followed(const Trial& first) {
  Trial trial = first;
  if (trial.effects.empty() || !nonlinear(trial) || decays_decide(trial)) return trial;
  // Where most runs are left with something it is not the search that is at fault.
  if (2 * std::count_if(trial.variance.begin(), trial.variance.end(), [](double left) { return left < explained; }) <= static_cast<std::ptrdiff_t>(trial.variance.size())) return trial;
  for (std::size_t r = 0; r < trial.variance.size(); ++r) {
    if (trial.arrival.joint.runs()[r].is_aside() || !(trial.variance[r] > twice_the_noise)) continue;
    std::optional<Trial> again = followed_by_the_others(trial, r);
    if (again && again->excess() < half_of_it * trial.excess()) trial = std::move(*again);
  }
  return trial;
}

}  // namespace unrig
