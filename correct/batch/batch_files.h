#pragma once
#include <optional>
#include <string>
#include <vector>

#include "correct/batch/batch.h"

namespace unrig {

/// A case as it is kept, with the names of the files that it read.
std::string kept_text(const BatchCase& one, const std::vector<std::string>& files);
/// What kept_text wrote, its messages with the names that the files have now; none where it is damaged.
std::optional<BatchCase> kept_case(const std::string& text, const std::vector<std::string>& files);

/// What `unrig collect` puts together, and what the table is made from: rows and cases, in JSON.
std::string to_json(const BatchResult& result);
/// Throws InputError naming the file for what is none.
BatchResult batch_result(const nlohmann::ordered_json& json, const std::string& path);

/// The shards of one batch as one result, whatever their number and order. Throws InputError as all_cases (fit/trial/parts.h).
BatchResult collected(const std::vector<BatchResult>& shards, const std::vector<std::string>& paths);

/// A row per run file, all numbers of all commands; units in the header.
struct BatchTable {
  std::vector<std::string> header;
  std::vector<std::vector<std::string>> rows;
};
/// `digits` of numbers; 0: as many as it takes to read the same number back.
BatchTable table_of(const BatchResult& result, int digits = 0);
/// table_of as comma-separated values (RFC 4180, lines end with LF).
std::string to_csv(const BatchResult& result);

/// How many rows ended how: "3 done, 1 unusable".
std::string count_of_rows(const BatchResult& result);
/// For a person.
std::string report(const BatchResult& result);

}  // namespace unrig
