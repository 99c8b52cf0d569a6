#pragma once
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "core/files/kept_cases.h"
#include "core/files/provenance.h"
#include "fit/trial/trial.h"

namespace unrig {

/// trial.json (correct/manual/results.md). `seconds`: with how long each diagnosis took, which no two calls agree in.
std::string to_json(const TrialResult& result, const Provenance& made = {}, bool seconds = true);

/// For a person.
std::string report(const TrialResult& result);

/// What to_json wrote. Throws InputError naming the file for what is no result of `unrig trial`.
TrialResult read_trial(const std::string& path);

/// The shards of one study as one result, whatever their number and order. The counts are made anew.
/// Throws InputError where they are of different studies, disagree on a trial, or leave one out.
TrialResult collected(const std::vector<TrialResult>& shards, const std::vector<std::string>& paths);

/// Sixteen hexadecimal digits of all that an outcome depends on: program version, rig, recordings, effects, options and seed, but neither shard nor number of trials.
std::string study_of(const TrialProblem& problem, const std::vector<std::string>& effects);

/// The outcomes of a study's trials in a folder of its own (core/files/kept_cases.h).
class TrialCases {
 public:
  /// An empty `folder` keeps nothing. Throws InputError where the folder cannot be made.
  TrialCases(const std::string& folder, const std::string& study);
  /// A kept outcome; none where there is none or its file is damaged.
  std::optional<TrialOutcome> find(std::size_t trial) const;
  void keep(const TrialOutcome& outcome) const;

 private:
  KeptCases cases_;
};

}  // namespace unrig
