#pragma once
#include <string>
#include <vector>

#include "correct/batch/batch.h"

namespace unrig {

/// The numbers of a result file that go into the table: into one.values, and into one.by_run of the runs `files` (BatchCampaign::all_runs, in that order).
/// `text` is what the command wrote. Throws std::exception for what is no such result.
void take_values(BatchCase& one, const std::string& text, const std::vector<std::string>& files);

}  // namespace unrig
