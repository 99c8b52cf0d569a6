#include "fit/diagnose/exact_model.h"

#include "core/effects/effect.h"
#include "fit/diagnose/heldout.h"

namespace unrig {
namespace {

FitProblem with_law(FitProblem problem, const HiddenLaw& hidden) {
  problem.rig.laws = {hidden.law};
  problem.effects = {hidden.law->id};
  return problem;
}

}  // namespace

ExactModel::ExactModel(const HiddenLaw& hidden, const FitProblem& files, const Trial& base) : problem_(with_law(files, hidden)), exact_(prepare(problem_, base, problem_.effects)) {
  set_starts(exact_.arrival.joint, hidden.truth);
  fit_decays_first(exact_, base, true);
  follow_further(exact_, INFINITY);
  exact_.arrival.joint.solve({});
  measure(exact_);
  told_.reduced_chi2 = exact_.reduced_chi2();
  hold_against(base);
}

AgainstTruth ExactModel::told(const std::vector<Run>& heldout) const {
  AgainstTruth told = told_;
  for (const Run& run : heldout) told.heldout.push_back(predict_heldout(exact_.arrival, run).rms);
  return told;
}

}  // namespace unrig
