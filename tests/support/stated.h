#pragma once
#include <gtest/gtest.h>

#include <string>

#include "core/rig/rig.h"
#include "core/run/run.h"
#include "core/files/text_file.h"
#include "tests/support/temporary_directory.h"

namespace unrig::test {

/// `text` with `line` before the first `place`.
inline std::string with_line(const std::string& text, const std::string& place, const std::string& line) {
  const std::size_t at = text.find(place);
  EXPECT_NE(at, std::string::npos) << place;
  return at == std::string::npos ? text : text.substr(0, at) + line + "\n" + text.substr(at);
}

inline Rig rig_of_text(const std::string& text) {
  const TemporaryDirectory directory;
  return read_rig(directory.file("rig.toml", text));
}

/// The rig file of a campaign with 1 % of each mass stated.
inline std::string with_masses_stated(const std::string& rig, const std::string& statement = "mass.std_percent = 1.0") { return with_line(rig, "mass.unit", statement); }

/// A recording that states something at its head.
inline Run run_that_states(const std::string& path, const std::string& statement) { return parse_run(with_line(read_text(path), "# speed =", "# " + statement), path); }

}  // namespace unrig::test
