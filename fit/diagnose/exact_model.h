#pragma once
#include <vector>

#include "fit/diagnose/diagnose.h"
#include "fit/search/effect_search.h"

namespace unrig {

/// The law that a simulated campaign hides, fitted from where it truly is, beside what a diagnosis tries.
class ExactModel {
 public:
  /// Fits it beside `base`, a fit to the rig and the runs of `files`, all of which live as long as this.
  ExactModel(const HiddenLaw& hidden, const FitProblem& files, const Trial& base);
  ExactModel(const ExactModel&) = delete;
  ExactModel& operator=(const ExactModel&) = delete;

  void hold_against(const Trial& set) { told_.behind.emplace_back(set.effects, deviance_difference(set, exact_)); }
  /// With what it leaves of these runs.
  AgainstTruth told(const std::vector<Run>& heldout) const;

 private:
  FitProblem problem_;
  Trial exact_;
  AgainstTruth told_;
};

}  // namespace unrig
