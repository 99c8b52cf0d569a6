#include "fit/likelihood/law_reach.h"

#include <algorithm>

#include "core/law/law_effect.h"
#include "core/model/run_inputs.h"
#include "core/propagate/nonlinear_response.h"

namespace unrig {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

/// Outputs of a system in the motion, start and inputs that a run was found to have.
MatrixXd outputs_of(const RunResidual& run, const RunResidual::Prediction& found, LinearSystem system, const VectorXd& theta) {
  const Index samples = run.run().samples();
  VectorXd start = VectorXd::Zero(system.states());
  for (std::size_t i = 0; i < run.free_states().size(); ++i)
    if (run.free_states()[i] < start.size()) start[run.free_states()[i]] = found.initial_state[static_cast<Index>(i)];
  const MatrixXd input = run_inputs(run.run(), run.conditions());
  for (Feedback& f : system.feedback) f.steps_per_sample *= run.finer();
  if (system.feedback.empty()) return drive(system, exact_step(system, run.run().dt), DualMatrix(start), samples, found.motion.jerk, input.cols() > 0 ? input : MatrixXd(), Partials::none).output;
  return follow(system, step_to_follow(system, run.run().dt), theta, {start, found.motion.jerk, input, MatrixXd(system.states(), 0), {}}, samples, Partials::none).output;
}

}  // namespace

std::vector<Sight> seen_by_laws(const RunResidual& run, const VectorXd& theta, Sights which) {
  const std::vector<std::string>& effects = run.model().effect_ids();
  if (std::none_of(effects.begin(), effects.end(), is_law_id)) return {};
  LinearSystem system = run.model().system(run.conditions(), theta, run.channels());
  for (DualMatrix* m : {&system.A, &system.B, &system.C, &system.D}) m->partial.clear();
  std::vector<Sight> sights = append_sights(system, run.model(), run.conditions(), which);
  if (sights.empty()) return {};
  const RunResidual::Prediction found = run.predict(theta);
  if (!found.output.allFinite()) return {};
  const MatrixXd output = outputs_of(run, found, std::move(system), theta);
  if (!output.allFinite()) return {};
  take_values(sights, output.rightCols(static_cast<Index>(sights.size())), run.run().dt);
  return sights;
}

std::map<std::string, LearntOn> reach_of_laws(const JointProblem& joint) {
  std::map<std::string, LearntOn> reach;
  for (std::size_t r = 0; r < joint.runs().size(); ++r)
    if (!joint.runs()[r].is_aside()) widen(reach, seen_by_laws(joint.runs()[r], joint.theta(r), Sights::all));
  for (auto& [id, learnt_on] : reach)
    for (auto& [symbol, range] : learnt_on) range = rounded_outward(range);
  return reach;
}

}  // namespace unrig
