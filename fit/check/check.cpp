#include "fit/check/check.h"

#include <algorithm>

#include "core/files/error.h"
#include "core/files/text_file.h"

namespace unrig {
namespace {

/// What the runs could determine; of input that cannot be right, or that a fit refuses, why nothing is said.
void foresee(const Rig& rig, const std::vector<Run>& runs, Checked& checked) {
  if (runs.empty()) return;
  if (any_grave(checked.suspicions)) {
    checked.not_foreseen = "not looked at, since the input cannot be right";
    return;
  }
  try {
    checked.foreseen = foresee(rig, runs);
  } catch (const InputError& e) {  // what a fit would refuse
    checked.not_foreseen = "not looked at, since a fit refuses the input";
    const std::string text = e.what();
    const auto run = std::find_if(runs.begin(), runs.end(), [&](const Run& r) { return text.starts_with(r.file); });
    checked.suspicions.push_back({base_name(run == runs.end() ? rig.file : run->file), {text}, 1, 0, true, text});
  } catch (const NoAnswer& e) {
    checked.not_foreseen = e.what();
  }
}

}  // namespace

bool any_grave(const std::vector<Suspicion>& suspicions) {
  return std::any_of(suspicions.begin(), suspicions.end(), [](const Suspicion& s) { return s.grave; });
}

Checked check(const Rig& rig, const std::vector<Run>& runs) {
  Checked checked;
  checked.rig_file = rig.file;
  checked.rig = summary_of(rig, runs);
  for (const Run& run : runs) checked.runs.push_back(summary_of(rig, run));
  checked.suspicions = suspicions(rig, runs);
  foresee(rig, runs, checked);
  return checked;
}

}  // namespace unrig
