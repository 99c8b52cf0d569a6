#pragma once
#include <string>
#include <vector>

#include "core/run/run.h"
#include "tests/support/temporary_directory.h"

namespace unrig::test {

inline const std::string head =
    "# unrig_run = 1\n"
    "# kind = \"step\"\n"
    "# density = \"998.2 kg/m^3\"\n"
    "# speed = \"2 ft/s\"\n";  // four lines: the header row is line 5, the first row of numbers line 6

inline const std::string small_table =
    "time [s],alpha [deg],gauge [N]\n"
    "0.0,1,10\n"
    "0.1,2,20\n"
    "0.2,3,30\n";

inline Run read(const std::string& text) {
  const TemporaryDirectory directory;
  return read_run(directory.file("step_a.csv", text));
}

/// What the reader has against the text; "no error" where it has nothing.
inline std::string refusal(const std::string& text) {
  try {
    read(text);
  } catch (const InputError& error) {
    return error.what();
  }
  return "no error";
}

inline std::vector<double> values(const Channel& channel) { return {channel.value.begin(), channel.value.end()}; }

}  // namespace unrig::test
