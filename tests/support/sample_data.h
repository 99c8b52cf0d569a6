#pragma once
#include <string>

namespace unrig::test {

/// Path of a file of the project: "sample_data/campaigns/null/rig.toml".
inline std::string source_path(const std::string& relative) { return std::string(UNRIG_SOURCE_DIR) + "/" + relative; }

/// Path of a file of the sample campaign without hidden effects.
inline std::string null_campaign(const std::string& file) { return source_path("sample_data/campaigns/null/" + file); }

}  // namespace unrig::test
