#pragma once
#include <cstddef>
#include <functional>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "correct/batch/batch_file.h"
#include "fit/trial/shard.h"

namespace unrig {

/// How a command on a campaign ended, from the best to the worst. `left_out`: a correction without a fit to rest on. `failed`: it crashed.
enum class CaseStatus { done, left_out, no_answer, unusable, failed };
std::string to_string(CaseStatus status);

/// A number or a text of a result, for a column `command.name [unit]`.
struct BatchValue {
  std::string name, unit;     ///< no unit: text, or a truth value
  nlohmann::ordered_json value;  ///< null where the result has none
};

/// One command on one campaign, or `correct` on one of its runs, and what came of it.
struct BatchCase {
  std::size_t campaign = 0;        ///< from 0
  std::string command;
  std::optional<std::size_t> run;  ///< of BatchCampaign::all_runs; none: all that the command takes
  CaseStatus status = CaseStatus::done;
  std::vector<std::string> messages, warnings;
  std::vector<BatchValue> values;              ///< of the campaign, or of the one run
  std::vector<std::vector<BatchValue>> by_run; ///< of each of all_runs; empty: none
};

/// A run file, a row of the table.
struct BatchRow {
  std::size_t campaign = 0, run = 0;
  std::string campaign_name, file;
  std::string part;                    ///< "fitted", "held out", "further"
  std::string kind, medium;            ///< empty where its head cannot be read
  std::optional<double> density, speed;  ///< kg/m^3, m/s
};

struct BatchResult {
  std::string study;               ///< fingerprint of all that the cases depend on
  std::vector<BatchRow> rows;
  std::size_t planned = 0;         ///< cases of all shards together
  std::vector<std::pair<std::size_t, BatchCase>> cases;  ///< with their numbers, ascending
  std::size_t shard = 1, shards = 1;
};

struct BatchProblem {
  Batch batch;
  std::string cases;                  ///< folder in which every result is kept and found again
  std::size_t shard = 1, shards = 1;  ///< which part of the cases is computed
  HandOut hand_out;                   ///< if it is set: whose turn it says, one after the other
  int threads = 0;                    ///< 0: as many as the machine has
  std::function<void(const std::string&)> progress;
};

/// Every campaign's commands, each in a process of its own, as `unrig COMMAND` computes them (core/files/run_command.h). A case is known by its key: the program's version, the command and its options, and the
/// contents of rig, runs and laws in their order, not their names. What was kept under it is not computed again, except after a crash.
///
/// A shard takes the campaigns whose turn it is, a rank those that it is handed out; of a campaign with more than 16 corrections every 16 have a turn of their own, and the fit that they rest on is computed there too where it is not kept.
/// Throws InputError where the folder of cases cannot be had.
BatchResult run_batch(const BatchProblem& problem);

}  // namespace unrig
