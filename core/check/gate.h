#pragma once
#include <string>
#include <vector>

#include "core/rig/rig.h"
#include "core/run/run.h"

namespace unrig {

/// Something about the input that cannot be right, or that was left out.
struct Suspicion {
  std::string where;                ///< the run's file, "all runs", or the rig file
  std::vector<std::string> causes;  ///< in words, two at most
  double factor = 1;                ///< given over what the others say; -1 a sign
  double weight = 0;                ///< chi-square by which the data are more plausible without it
  bool grave = false;               ///< no answer from such input can be trusted
  std::string text;                 ///< the line, without "check: "
};

/// Are rig file and recordings plausible? Looked at are, each run alone, frequency, steady load and ringing (core/check/run_estimate.h), and what the rig says of them.
///
/// The measure is how far the logarithms of these ratios are from what rigs and fluids can be and from each other, in units of the spread over all
/// sample campaigns (gate.cpp has the numbers). Where it is bad, every known slip (core/check/causes.h) is undone in turn, in each run, all runs and the rig file;
/// the one that makes the campaign plausible is named, with its equal where these runs cannot tell two apart. Costs 20 ms for right data, a second for wrong.
std::vector<Suspicion> suspicions(const Rig& rig, const std::vector<Run>& runs);

/// Prints each as a line `check: ...` on standard error.
void tell(const std::vector<Suspicion>& suspicions);

/// The gate before a long search: tells of all suspicions, and throws NoAnswer where one is grave. `anyway`: it only tells, for whoever knows better.
/// A run in which what drives it never changes is left to the InputError of check_what_drives.
void pass_the_gate(const Rig& rig, const std::vector<Run>& runs, bool anyway);

/// What `--anyway` says of itself in `--help`.
constexpr const char* anyway_help = "go on although the check finds that the input cannot be right";

}  // namespace unrig
