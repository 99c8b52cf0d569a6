#pragma once
#include <array>
#include <cstdint>
#include <functional>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "fit/likelihood/joint_problem.h"
#include "fit/propose/candidate_runs.h"
#include "fit/propose/explanations.h"
#include "fit/propose/limits.h"

namespace unrig {

struct ProposeProblem {
  Rivals rivals;
  Limits limits;
  int refits = 4;          ///< how many of the best candidates are simulated and refitted, per comparison
  int draws = 4;           ///< and how often the best one, with noise and drawn parameters, under either explanation
  std::uint64_t seed = 1;  ///< of noise and draws
  std::function<void(const std::string&)> progress = {};
};

/// What a candidate run would say of two explanations.
struct ExpectedOutcome {
  static constexpr double unknown = std::numeric_limits<double>::quiet_NaN();
  std::size_t candidate = 0;
  std::string failed;                                            ///< why it could not be simulated or held against a model
  std::pair<double, double> linear = {unknown, unknown};         ///< expected log odds of the first if it is true, of the second if that is; to first order
  std::pair<double, double> refitted = {unknown, unknown};       ///< the same, simulated without noise and both refitted; not a number where a refit did not arrive
  std::pair<std::vector<double>, std::vector<double>> drawn;     ///< log odds of the true one, simulated with noise and drawn parameters, where both refits arrived
  /// Unknowns of the refits without noise: where the first is true, of the first and of the second; then where the second is.
  std::array<std::vector<Unknown>, 4> ends;
  std::array<double, 4> risen = {0, 0, 0, 0};  ///< chi-square there, less that of the runs at hand alone
  int searches = 0, arrived = 0;                                 ///< refits, and how many of them arrived

  bool was_refitted() const { return searches > 0; }
  /// The best of these that is known: mean of the draws, else refitted, else to first order where nothing was refitted.
  std::pair<double, double> expected() const;
  /// The lesser of both; not a number where either is not known.
  double least() const;
};

/// Two explanations, and the candidates, best first.
struct Comparison {
  std::size_t first = 0, second = 0;
  std::vector<ExpectedOutcome> outcomes;  ///< repeats of runs at hand are not among them
  ExpectedOutcome repeat;                 ///< the best of those, to first order
  /// Whether the best is expected to decide, whichever is true (enough_to_decide).
  bool decides() const;
};

struct Plan {
  std::vector<Explanation> explanations;
  std::vector<double> log_odds_now;     ///< of the first explanation against each, from the runs at hand: half of the difference of BIC
  std::vector<std::string> no_answer;   ///< of each fit: why it is not to be trusted
  std::vector<CandidateRun> candidates;
  std::vector<Comparison> comparisons;  ///< of the first explanation with each of the others
  std::vector<std::size_t> ranking;     ///< candidates that are no repeats, by what they decide in the comparison that they decide least; those that were not refitted behind the others
  std::vector<std::string> remarks;
};

/// Which run would decide between the explanations?
///
/// Every explanation is fitted to the runs at hand. Each candidate is simulated under one and held against the other, and the other way round, to first order in the parameters (expected_log_odds). The best few are
/// simulated and both explanations are refitted to them and the runs at hand together; the best one several times, with noise and parameters drawn from what the runs at hand know of them. It counts what the run says if
/// the explanation is true that it would say less for.
/// Throws InputError where the limits allow no run or an effect cannot act.
Plan propose(const ProposeProblem& problem);

}  // namespace unrig
