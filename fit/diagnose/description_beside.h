#pragma once
#include <deque>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "fit/diagnose/diagnose.h"
#include "fit/diagnose/explanation.h"
#include "fit/diagnose/rig_description.h"
#include "fit/diagnose/search_limits.h"
#include "fit/diagnose/selection.h"

namespace unrig {

/// The rig's description beside laws, looked at once for each set.
class DescriptionBeside {
 public:
  /// Looks at the problem as long as it lives.
  explicit DescriptionBeside(const DiagnoseProblem& problem) : problem_(problem) {}
  /// Where it explains what a set leaves.
  const std::optional<RigDescription>& explains(const Trial& set);
  /// What was seen in another noise.
  void forget() { looked_at_.clear(); }

 private:
  const DiagnoseProblem& problem_;
  std::deque<std::pair<std::vector<std::string>, std::optional<RigDescription>>> looked_at_;
};

/// Laws beside the rig's description put right, from those of a set on; what was tried is added to the ranking of `selection`. Throws OutOfTime where the limit of the search is reached.
FoundSet laws_beside(const RigDescription& description, const DiagnoseProblem& problem, const Setting& files, const Trial& baseline, Selection& selection, const Trial* set = nullptr);

/// The rig's description against the laws that were `found`: with laws `beside` it, as far as these were looked for, where neither explains everything. True where it is the better explanation, then in `found`.
bool weigh_description(const DiagnoseProblem& problem, const Setting& files, const Trial& baseline, const RigDescription& description, std::optional<FoundSet> beside, Selection& selection, SearchLimits& limits, FoundSet& found);

}  // namespace unrig
