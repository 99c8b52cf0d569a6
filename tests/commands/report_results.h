#pragma once
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "tests/commands/run_unrig.h"
#include "tests/support/sample_data.h"

namespace unrig::test {

/// The results of the sample campaign in `directory`: fit.json, apparent.json, corrected.csv, indicial.csv. Three runs, so that it is quick.
inline void make_results(const TemporaryDirectory& directory) {
  const std::string rig = null_campaign("rig.toml"), dry = null_campaign("dry_pluck.csv"), wet = null_campaign("wet_pluck.csv"), step = null_campaign("step_a.csv");
  const std::vector<std::vector<std::string>> commands{
      {"fit", "--rig", rig, dry, wet, step, "-o", directory.path("fit.json")},
      {"apparent-mass", "--rig", rig, "--dry", dry, "--wet", wet, "--no-joint-fit", "-o", directory.path("apparent.json")},
      {"correct", "--rig", rig, "--fit", directory.path("fit.json"), step, "-o", directory.path("corrected.csv"), "--indicial", directory.path("indicial.csv")}};
  for (const std::vector<std::string>& command : commands) {
    const Finished finished = run_unrig(directory, command);
    ASSERT_EQ(finished.status, 0) << finished.err;
  }
}

/// A diagnosis with everything that the report can show, made up.
inline nlohmann::json made_up_diagnosis() {
  using nlohmann::json;
  json traces = {{"unit", "N"}}, map;
  for (int k = 0; k < 200; ++k) {
    traces["time"].push_back(0.01 * k);
    for (const char* name : {"measured", "before", "after", "missing_force"}) traces[name].push_back(std::sin(0.3 * k + name[0]));
    traces["missing_force_std"].push_back(0.1);
  }
  for (int i = 0; i < 5; ++i) map["time_frequency"]["time"].push_back(i);
  for (int j = 0; j < 3; ++j) {
    map["time_frequency"]["frequency"].push_back(2 * j);
    map["time_frequency"]["power"].push_back({1e-3, 1e-2, 0.1, 1, 10 * j});
  }
  map["restoring_force"] = {{"displacement", {-1, 0, 1}}, {"velocity", {-2, 2}}, {"force", {{-1, -2, -1}, {1, 2, nullptr}}}, {"unit", "N"}};
  return {{"unrig", "diagnosis"},
          {"mismatch", {{"found", true}, {"p_value", 1e-9}, {"runs", {"a/step_a.csv"}}, {"time", {{0.2, 1.4}}}, {"frequency", {{2, 4}}}, {"summary", "A line near 3 Hz."}}},
          {"missing", {{{"effect", "quadratic-drag"}, {"probability", 0.99}, {"equation", "F = -c v |v|"}, {"parameters", {{{"name", "c"}, {"value", 1.2}, {"std_error", 0.01}, {"unit", "N s^2/m^2"}}}}}}},
          {"equivalent", json::array({json::array({"tank-wave", "vortex-shedding"})})},
          {"unexplained", false},
          {"ranking", {{{"effect", "quadratic-drag"}, {"score", 1.0}, {"reduced_chi2", 1.1}, {"delta_bic", -400}, {"probability", 0.99}}}},
          {"improvement",
           {{"bic_before", 1000},
            {"bic_after", 600},
            {"runs", {{{"file", "a/step_a.csv"}, {"heldout", false}, {"rms_before", 0.2}, {"rms_after", 0.011}, {"noise", 0.01}, {"unit", "N"}, {"traces", traces}, {"map", map}}}}}}};
}

}  // namespace unrig::test
