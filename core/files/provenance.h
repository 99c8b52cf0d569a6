#pragma once
#include <string>
#include <string_view>
#include <vector>

namespace unrig {

/// What made a result: enough to make it again, and nothing that changes when it is.
struct Provenance {
  std::string program;  ///< "unrig 0.1.0"
  std::string command;  ///< as typed after `unrig`, quoted for a shell; without the options that decide nothing of the numbers
};

/// Of a command (`argv[0]` is its name). Where results are written and in how many threads they are computed is left out: -o, --output, --threads, --shard, and `outputs`.
Provenance provenance_of(int argc, const char* const* argv, const std::vector<std::string_view>& outputs = {});

/// Of a table of results, in the name of a column of ones (correct/estimate/how_far_to_trust.h says why there): the same in all files of one call.
struct MadeBy {
  Provenance provenance;
  std::string rig, run, fit;  ///< fingerprints

  /// Nothing where the program is not known.
  std::string column() const;
  static constexpr std::string_view prefix = "made by: ";
  /// Out of what follows the prefix; empty members where it does not say.
  static MadeBy of_column(std::string_view text);
};

}  // namespace unrig
