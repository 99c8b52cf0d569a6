#include <algorithm>
#include <map>
#include <set>

#include <fmt/format.h>

#include "correct/batch/batch_files.h"
#include "correct/report/result_files.h"

namespace unrig {
namespace {

constexpr int shown_digits = 6;

/// Columns that say something, and not the same thing twice: `warnings` has a table of its own, and what is empty in every row is left out.
BatchTable without_empty_columns(const BatchTable& table) {
  BatchTable shown;
  std::vector<std::size_t> kept;
  for (std::size_t c = 0; c < table.header.size(); ++c)
    if (table.header[c] != "warnings" && std::any_of(table.rows.begin(), table.rows.end(), [&](const auto& row) { return !row[c].empty(); })) kept.push_back(c);
  const auto take = [&](const std::vector<std::string>& cells) {
    std::vector<std::string> some;
    for (const std::size_t c : kept) some.push_back(cells[c]);
    return some;
  };
  shown.header = take(table.header);
  for (const auto& row : table.rows) shown.rows.push_back(take(row));
  return shown;
}

/// Every warning once, with how many campaigns have it.
void add_batch_warnings(ReportPage& page, const BatchResult& result) {
  std::map<std::string, std::set<std::size_t>> campaigns;
  for (const auto& [number, one] : result.cases)
    for (const std::string& warning : one.warnings) campaigns[warning].insert(one.campaign);
  if (campaigns.empty()) return;
  std::vector<std::vector<std::string>> rows;
  for (const auto& [warning, of] : campaigns) rows.push_back({std::to_string(of.size()), warning});
  page.add_table("Warnings", {"campaigns", "warning"}, rows);
}

}  // namespace

void add_batch(ReportPage& page, const BatchResult& result, const std::string& name) {
  const bool all_done = std::all_of(result.cases.begin(), result.cases.end(), [](const auto& one) { return one.second.status == CaseStatus::done; });
  page.add_verdict(all_done ? Tone::good : Tone::open, fmt::format("{} runs: {}.", result.rows.size(), count_of_rows(result)), name);
  page.add_section("Batch: " + name);
  const BatchTable shown = without_empty_columns(table_of(result, shown_digits));
  page.add_table("", shown.header, shown.rows,
                 "A row for each run file. What a command says of the whole campaign stands in the row of each of its runs. \"no answer\": exit status 1 of the command; \"unusable\": 2; \"left out\": no fit to rest on; \"failed\": a crash.");
  add_batch_warnings(page, result);
}

}  // namespace unrig
