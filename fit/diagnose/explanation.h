#pragma once
#include <Eigen/Core>
#include <memory>
#include <string>
#include <vector>

#include "fit/diagnose/diagnose.h"
#include "fit/search/effect_search.h"

namespace unrig {

/// A rig and its runs: as the files have them, or as their description was put right.
struct Setting {
  const FitProblem* problem;
  const std::vector<Run>* heldout;
  Eigen::VectorXd off = {};  ///< of the description, in standard deviations of the errors of its numbers (with_errors_of_files); empty of the files
};

/// The best set of laws in a setting, and what is to be said of it.
struct FoundSet {
  Setting setting;
  Trial best;
  double cost = 0;  ///< of the setting, as a difference of BIC
  Mismatch remaining;
  std::vector<ImprovedRun> unseen;
  bool predicts = false;
  FitResult fit = {};
  std::shared_ptr<const FitProblem> fitted = {};  ///< by `fit`, where it found numbers of the files too; else those of the setting

  bool clean() const { return !remaining.found; }
  bool explains() const { return clean() && predicts; }
};

/// Whether the best set of effects is named, or why not. `clean`: beside it no significant mismatch remains.
Naming naming_of(const Trial& best, const Trial& baseline, bool clean, bool predicts);

/// What remains beside `best`, a set in `setting`, and whether it predicts runs that were not fitted no worse than the fit with nothing missing to the rig as the `files` have it: those held out or, where there are
/// none, each fitted run from the others.
FoundSet look_at(const DiagnoseProblem& problem, const Setting& files, const Trial& baseline, const Setting& setting, Trial best, double cost);

}  // namespace unrig
