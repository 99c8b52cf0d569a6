#include "fit/diagnose/explanation.h"

#include <algorithm>
#include <cmath>

#include "core/effects/effect.h"
#include "core/law/law_effect.h"
#include "core/numerics/in_parallel.h"
#include "fit/diagnose/heldout.h"
#include "fit/diagnose/selection.h"

namespace unrig {
namespace {

/// Whether decays that decide are followed, to the noise or in nearly all that they had above it.
bool follows_decays(const Trial& trial, const Trial& baseline) {
  if (!decays_decide(trial) || trial.excess() > half_of_it * baseline.excess()) return false;  // the search leaves something of the other runs even when it has found what is missing
  const bool nearly = trial.decays.exactly && left_of_decays(trial) - 1 < (1 - enough_to_name) * (left_of_decays(baseline) - 1);
  return trial.decays.chi2 < explained || nearly;
}

/// What runs that were not fitted are left with, before and after. `best` is of the rig and the runs of `after`.
std::vector<ImprovedRun> predict_unseen(const Setting& before, const Arrival& baseline, const Setting& after, const Trial& best) {
  const std::vector<Run>& runs = before.problem->runs;
  const bool changed = !best.effects.empty() || after.problem != before.problem;
  const bool leave_out = before.heldout->empty() && runs.size() > 1 && changed;
  const std::vector<RunResidual>& fitted = best.arrival.joint.runs();
  const auto has_part = [](const RunResidual& run) { return !run.is_aside(); };
  const bool others_tell = std::count_if(fitted.begin(), fitted.end(), has_part) > 1;
  std::vector<std::size_t> predicted;  // not what no search follows, nor what nothing but itself has told of
  for (std::size_t i = 0; i < (leave_out ? runs.size() : before.heldout->size()); ++i)
    if (!leave_out || (has_part(fitted[i]) && others_tell)) predicted.push_back(i);
  std::vector<ImprovedRun> unseen(predicted.size());
  in_parallel(unseen.size(), [&](std::size_t i) {
    const std::size_t k = predicted[i];
    const Run& run = leave_out ? runs[k] : (*before.heldout)[k];
    const HeldoutResidual b = leave_out ? predict_left_out(baseline, k) : predict_heldout(baseline, run);
    const HeldoutResidual a = leave_out ? predict_left_out(best.arrival, k) : predict_heldout(best.arrival, (*after.heldout)[k]);
    unseen[i] = {run.file, b.channel, run.channel(b.channel).unit, true, leave_out, b.rms, a.rms, a.noise};
  });
  return unseen;
}

double power_over_noise(const std::vector<ImprovedRun>& runs, double ImprovedRun::* rms) {
  double sum = 0;
  for (const ImprovedRun& run : runs) sum += std::pow(run.*rms / run.noise, 2);
  return sum;
}

/// How much more than before, as a share, runs that were not fitted may be left with: what chi-square of so many samples scatters by, for where what was found hardly acts it is chance whether that is more or less.
double tolerated(const Setting& files) {
  double samples = 0;
  for (const Run& run : files.heldout->empty() ? files.problem->runs : *files.heldout) samples += static_cast<double>(run.samples());
  return std::sqrt(2 / samples);
}

}  // namespace

Naming naming_of(const Trial& best, const Trial& baseline, bool clean, bool predicts) {
  if (!predicts) return Naming::does_not_predict;
  if (clean || follows_decays(best, baseline)) return Naming::named;
  if (best.excess() > (1 - enough_to_name) * baseline.excess()) return Naming::removes_too_little;
  const bool only_signals = std::all_of(best.effects.begin(), best.effects.end(), [&](const std::string& id) { return is_a_signal(id, best.arrival.joint); });
  return only_signals ? Naming::only_signals : Naming::named;
}

FoundSet look_at(const DiagnoseProblem& problem, const Setting& files, const Trial& baseline, const Setting& setting, Trial best, double cost) {
  FoundSet e{setting, std::move(best), cost, {}, {}, false};
  e.remaining = what_remains(e.best);
  if (!problem.verdict_only) e.unseen = predict_unseen(files, baseline.arrival, setting, e.best);
  const bool adds_nothing = e.best.effects.empty() && setting.problem == files.problem;
  e.predicts = adds_nothing || power_over_noise(e.unseen, &ImprovedRun::rms_after) <= (1 + tolerated(files)) * power_over_noise(e.unseen, &ImprovedRun::rms_before);
  return e;
}

}  // namespace unrig
