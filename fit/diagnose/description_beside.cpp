#include "fit/diagnose/description_beside.h"

#include <algorithm>

#include "core/numerics/time_limit.h"
#include "fit/search/effect_search.h"

namespace unrig {
namespace {

/// The effects of `set` beside the rig's description put right, from where they stand.
Trial same_effects_beside(const RigDescription& description, const Trial& set) {
  Trial same = prepare(*description.problem, description.trial, set.effects);
  const JointProblem& known = set.arrival.joint;
  for (Unknown& u : same.arrival.joint.unknowns())
    for (const Unknown& k : known.unknowns())
      if (const Parameter &p = same.arrival.joint.parameter(u), &q = known.parameter(k); !p.effect.empty() && p.effect == q.effect && p.place == q.place && u.run == k.run) u.value = k.value;
  fit_fully(same, 6);
  return same;
}

}  // namespace

const std::optional<RigDescription>& DescriptionBeside::explains(const Trial& set) {
  const auto known = std::find_if(looked_at_.begin(), looked_at_.end(), [&](const auto& l) { return same_set(l.first, set.effects); });
  if (known != looked_at_.end()) return known->second;
  std::optional<RigDescription> there = describe_rig(problem_, set, half_of_it);
  if (there && there->left > explained) there.reset();
  return looked_at_.emplace_back(set.effects, std::move(there)).second;
}

FoundSet laws_beside(const RigDescription& description, const DiagnoseProblem& problem, const Setting& files, const Trial& baseline, Selection& selection, const Trial* set) {
  DiagnoseProblem there = problem;
  there.rig = description.problem->rig;
  Selection beside(there, *description.problem, description.trial);
  std::optional<Trial> begun;
  if (set) begun = same_effects_beside(description, *set);
  Trial best = beside.best_set({}, begun ? &*begun : nullptr);
  if (beside.stopped()) throw OutOfTime{};
  FoundSet with = look_at(problem, files, baseline, description.setting(), std::move(best), description.cost);
  for (Candidate c : beside.ranking()) {
    if (c.effects.empty()) continue;
    c.effects.insert(c.effects.begin(), rig_description_id);
    c.delta_bic += bic_difference(description.trial, baseline) + description.cost;
    selection.add(std::move(c));
  }
  return with;
}

bool weigh_description(const DiagnoseProblem& problem, const Setting& files, const Trial& baseline, const RigDescription& description, std::optional<FoundSet> beside, Selection& selection, SearchLimits& limits, FoundSet& found) {
  const double against_baseline = bic_difference(description.trial, baseline) + description.cost;
  selection.add({{rig_description_id}, description.trial.reduced_chi2(), against_baseline, 0, description.promised});
  if (found.explains() && against_baseline > -decisive) return false;
  FoundSet with = beside ? std::move(*beside) : look_at(problem, files, baseline, description.setting(), description.trial, description.cost);
  if (!with.explains() && !found.explains() && !beside) limits.spend([&] { with = laws_beside(description, problem, files, baseline, selection); });
  const bool laws_named = !found.best.effects.empty() && naming_of(found.best, baseline, found.clean(), found.predicts) == Naming::named;
  if (!with.explains() || (laws_named && bic_difference(found.best, with.best) - with.cost < -decisive)) return false;
  found = std::move(with);
  return true;
}

}  // namespace unrig
