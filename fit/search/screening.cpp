#include "fit/search/screening.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "core/effects/effect.h"
#include "core/law/law_effect.h"
#include "core/numerics/in_parallel.h"
#include "core/propagate/feedback_force.h"
#include "fit/search/search_numbers.h"

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// How many laws act in a run.
Index laws_in(const RunResidual& run) { return static_cast<Index>(run.model().system(run.conditions(), run.model().start_values(), run.channels()).feedback.size()); }

/// Which of these starts, and where it leads: to where some iterations end, if that halves the chi-square `without` the effect, and to the best as it is if not. What starts leave as they are
/// favours the one at which an effect does least. Where iterations are `dear` the best start is taken as it is.
JointProblem best_of(const std::vector<JointProblem>& starts, double without, bool dear) {
  if (starts.size() == 1) return starts.front();
  const auto least = [](const std::vector<JointProblem>& joints) {
    std::vector<double> left(joints.size());
    in_parallel(joints.size(), [&](std::size_t i) {
      left[i] = joints[i].chi2();
      if (!std::isfinite(left[i])) left[i] = std::numeric_limits<double>::max();
    });
    const auto best = std::min_element(left.begin(), left.end());
    return std::pair(*best, static_cast<std::size_t>(best - left.begin()));
  };
  const std::size_t start = least(starts).second;
  if (dear) return starts[start];
  std::vector<JointProblem> solved = starts;
  in_parallel(solved.size(), [&](std::size_t i) {
    JointProblem::SolveOptions options;
    options.iterations = 8;
    options.most_evaluations = 12;
    options.tolerance = 1e-2;
    solved[i].solve(options);
  });
  const auto [left, end] = least(solved);
  return left < half_of_it * without ? solved[end] : starts[start];
}

void set_values(JointProblem& joint, const std::string& id, const VectorXd& values) {
  for (Unknown* u : unknowns_of(joint, id)) u->value = values[joint.parameter(*u).place];
}

bool with_motions(const JointProblem& joint) {
  return std::any_of(joint.runs().begin(), joint.runs().end(), [](const RunResidual& run) { return run.motion().unknowns() > 0; });
}

JointProblem back_at_the_rig(const JointProblem& joint) {
  JointProblem there = joint;
  back_to_the_rig(there, 2);
  return there;
}

void glance(JointProblem& joint, bool only) {
  for (RunResidual& run : joint.runs()) run.glance(only);
}

}  // namespace

double left_by_a_step(const JointProblem& joint) {
  const JointProblem::Linearisation lin = joint.linearise();
  std::vector<Index> free;
  for (std::size_t i = 0; i < joint.unknowns().size(); ++i)
    if (!joint.unknowns()[i].held && lin.jacobian.col(static_cast<Index>(i)).norm() > 0) free.push_back(static_cast<Index>(i));
  if (!lin.residual.allFinite()) return INFINITY;
  return linear_step(lin.jacobian(Eigen::all, free), lin.residual).left;
}

Screening::Screening(const FitProblem& problem, const Arrival& without) : problem_(problem), without_(without), base_(without.joint) {
  if (base_.first_order.known()) {
    left_ = base_.first_order.left();
  } else {
    JointProblem alone = without.joint;
    glance(alone, true);
    left_ = left_by_a_step(alone);
  }
  constexpr double astray = 10;
  JointProblem moved = without.joint;
  if (!back_to_the_rig(moved, astray)) return;
  at_the_rig_ = std::make_unique<const Base>(back_at_the_rig(moved));
  if (has_decays(without.joint)) beside_ = beside_unknown_forces(without.joint);
}

bool Screening::is_law(const JointProblem& joint, const std::string& id) const {
  for (std::size_t r = 0; r < joint.runs().size(); ++r)
    if (effect(problem_.rig, id).acts(joint.model().rig(), joint.runs()[r].conditions()) && laws_in(joint.runs()[r]) > laws_in(without_.joint.runs()[r])) return true;
  return false;
}

/// Largest first argument of the laws that are new in `joint`, along the states that the decays ask for beside unknown forces; 0 without decays.
double Screening::largest_argument_of_readings(const JointProblem& joint) const {
  if (!beside_) return 0;
  double largest = 0;
  for (std::size_t r = 0; r < joint.runs().size(); ++r) {
    const MatrixXd& states = beside_->states[r];
    if (states.size() == 0) continue;
    const RunResidual& run = joint.runs()[r];
    const Arguments arguments(run.model().system(run.conditions(), joint.theta(r), run.channels()));
    for (std::size_t k = static_cast<std::size_t>(laws_in(without_.joint.runs()[r])); k < arguments.first.size(); ++k)
      largest = std::max(largest, (arguments.sees.value.row(arguments.first[k]).head(states.rows()) * states).cwiseAbs().maxCoeff());
  }
  return largest;
}

std::vector<VectorXd> Screening::starts_of(JointProblem& joint, const std::string& id) const {
  const Effect& e = effect(problem_.rig, id);
  if (e.frequency && !e.parameters_on(joint.model().rig()).empty()) return tone_starts(judge().lines, joint, e);
  if (!e.starts_for) return e.starts;
  double largest = largest_argument_of_readings(joint);
  if (!(largest > 0) && judge().first_order.known()) largest = judge().first_order.promise(joint, id).largest_argument;
  return largest > 0 ? e.starts_for(joint.model(), largest) : e.starts;
}

/// The best of an effect's starts; never none of it, from where it may have no slope.
JointProblem Screening::best_start(const JointProblem& joint, const std::string& id) const {
  JointProblem best = joint;
  std::vector<VectorXd> starts = starts_of(best, id);
  if (starts.empty()) return best;
  if (starts.size() == 1) {
    set_values(best, id, starts.front());
    return best;
  }
  if ((with_motions(joint) || is_law_id(id)) && is_law(joint, id) && judge().first_order.known()) {
    double least = INFINITY;
    VectorXd chosen = starts.front();
    for (const VectorXd& start : starts) {
      set_values(best, id, start);
      if (const double left = judge().first_order.promise(best, id).left; left < least) least = left, chosen = start;
    }
    set_values(best, id, chosen);
    return best;
  }
  std::vector<JointProblem> at;
  for (const VectorXd& start : starts) {
    at.push_back(joint);
    set_values(at.back(), id, start);
  }
  const std::vector<RunResidual>& known = without_.joint.runs();
  const bool has_laws = std::any_of(known.begin(), known.end(), [](const RunResidual& run) { return laws_in(run) > 0; });
  return best_of(at, without_.joint.chi2(), with_motions(joint) || has_laws);
}

Arrival transferred(const FitProblem& problem, const Arrival& without, const std::shared_ptr<const AeroelasticModel>& model) {
  Arrival arrival{model, without.windows, make_joint(*model, problem.runs, without.windows, 0)};
  for (const Unknown& known : without.joint.unknowns()) {
    const std::string& name = without.joint.parameter(known).name;
    for (Unknown& u : arrival.joint.unknowns())
      if (u.run == known.run && arrival.joint.parameter(u).name == name) u.value = known.value;
  }
  const VectorXd anywhere = model->start_values();
  for (std::size_t r = 0; r < arrival.joint.runs().size(); ++r) {
    RunResidual& run = arrival.joint.runs()[r];
    const RunResidual& known = without.joint.runs()[r];
    run.keep_noise_of(known);
    RunResidual::FirstOrder::start(run, known);
    run.follow_in(known.finer());
    run.set_aside(known.is_aside() && run.takes_small_steps(anywhere));
  }
  return arrival;
}

Screening::Extended Screening::extend(const std::shared_ptr<const AeroelasticModel>& model, const std::vector<std::string>& added) const {
  Extended extended{transferred(problem_, without_, model)};
  JointProblem& joint = extended.arrival.joint;
  glance(joint, true);
  JointProblem looked_at = at_the_rig_ ? back_at_the_rig(joint) : joint;
  for (const std::string& id : added) {
    if (problem_.progress) problem_.progress("looking for " + id);
    looked_at = best_start(looked_at, id);
    const std::vector<Unknown*> own = unknowns_of(joint, id), found = unknowns_of(looked_at, id);
    for (std::size_t k = 0; k < own.size(); ++k) own[k]->value = found[k]->value;
  }
  if (!at_the_rig_) joint = std::move(looked_at);
  set_starts(joint, problem_.start);
  const bool to_first_order = added.size() == 1 && base_.first_order.known() && is_law(joint, added.front());
  extended.left = to_first_order ? base_.first_order.promise(joint, added.front()).left : left_by_a_step(joint);
  if (extended.left > left_ && !with_motions(joint)) extended.left = std::min(extended.left, joint.chi2());  // from where iterations have led to first order all is lost
  extended.share = 1 - extended.left / left_;
  glance(joint, false);
  return extended;
}

}  // namespace unrig
