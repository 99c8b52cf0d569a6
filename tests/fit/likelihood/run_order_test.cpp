// No digit of a result depends on the order in which its runs were given, and it is told in that order.

#include "fit/likelihood/run_order.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <nlohmann/json.hpp>

#include "core/rig/fingerprint.h"
#include "fit/diagnose/diagnose.h"
#include "fit/diagnose/diagnosis_files.h"
#include "fit/fit_files.h"
#include "tests/support/sample_data.h"

namespace unrig {
namespace {

using nlohmann::json;


std::vector<unrig::Run> runs_of(const std::string& campaign, const std::vector<std::string>& names) {
  std::vector<unrig::Run> runs;
  for (const std::string& name : names) runs.push_back(read_run(test::source_path("sample_data/campaigns/" + campaign + "/" + name + ".csv")));
  return runs;
}

/// Numbers and texts by what they belong to, in no order: parameters by name and run, correlations by both of theirs, entries of lists by their run.
std::map<std::string, json> by_name(const json& fit) {
  std::map<std::string, json> all;
  const auto label = [](const json& p) { return p["name"].get<std::string>() + " " + p.value("run", ""); };
  const json& parameters = fit["parameters"];
  for (std::size_t i = 0; i < parameters.size(); ++i) {
    all[label(parameters[i])] = parameters[i];
    for (std::size_t j = 0; j < parameters.size(); ++j) all[label(parameters[i]) + " with " + label(parameters[j])] = fit["correlation"][i][j];
  }
  for (const json& run : fit["runs"]) all["run " + run["file"].get<std::string>()] = run;
  for (const char* key : {"chi2", "reduced_chi2", "aic", "bic", "observations", "variables", "rig_fingerprint"}) all[key] = fit[key];
  return all;
}

std::vector<std::string> files_of(const std::vector<unrig::Run>& runs) {
  std::vector<std::string> files;
  for (const unrig::Run& run : runs) files.push_back(run.file);
  return files;
}

TEST(RunOrder, ShufflingTheRunsChangesNoDigitOfAFit) {
  FitProblem problem;
  problem.rig = read_rig(test::null_campaign("rig.toml"));
  problem.runs = runs_of("null", {"dry_pluck", "wet_pluck", "step_a", "step_b"});
  problem.profile = {"normal_force_slope"};
  const json as_sorted = json::parse(to_json(fit(problem)));
  for (const std::vector<std::size_t>& order : {std::vector<std::size_t>{3, 2, 1, 0}, {2, 0, 3, 1}}) {
    FitProblem shuffled = problem;
    shuffled.runs = in_order(problem.runs, order);
    const json told = json::parse(to_json(fit(shuffled)));
    EXPECT_EQ(by_name(told), by_name(as_sorted));
    std::vector<std::string> files, slopes, profiles;
    for (const json& run : told["runs"]) files.push_back(run["file"]);
    EXPECT_EQ(files, files_of(shuffled.runs)) << "told in the order in which they were given";
    for (const json& p : told["parameters"])
      if (p["name"] == "normal_force_slope") slopes.push_back(p["run"]);
    for (const json& p : told["profile"]) profiles.push_back(p["run"]);
    std::vector<std::string> steps = files_of(shuffled.runs);
    std::erase_if(steps, [](const std::string& file) { return file.find("step") == std::string::npos; });
    EXPECT_EQ(slopes, steps);
    EXPECT_EQ(profiles, steps);
  }
}

TEST(RunOrder, ShufflingTheRunsChangesNoDigitOfADiagnosis) {
  DiagnoseProblem problem;
  problem.rig = read_rig(test::source_path("sample_data/campaigns/wave/rig.toml"));
  problem.runs = runs_of("wave", {"wet_pluck", "step_a", "step_b"});
  problem.effects = {"tank-wave", "gauge-drift"};
  const json as_sorted = json::parse(to_json(diagnose(problem)));
  DiagnoseProblem shuffled = problem;
  shuffled.runs = in_order(problem.runs, {2, 0, 1});
  const json told = json::parse(to_json(diagnose(shuffled)));

  EXPECT_EQ(by_name(told["fit"]), by_name(as_sorted["fit"]));
  for (const char* key : {"verdict", "ranking", "unexplained", "equivalent"}) EXPECT_EQ(told[key], as_sorted[key]) << key;
  EXPECT_EQ(told["mismatch"]["p_value"], as_sorted["mismatch"]["p_value"]);
  for (const char* number : {"bic_before", "bic_after"}) EXPECT_EQ(told["improvement"][number], as_sorted["improvement"][number]);
  const auto by_run = [](const json& list, const char* name) {
    std::map<std::string, json> all;
    for (const json& item : list) all[item[name].get<std::string>() + (item.value("left_out", false) ? " left out" : "")] = item;
    return all;
  };
  EXPECT_EQ(by_run(told["improvement"]["runs"], "file"), by_run(as_sorted["improvement"]["runs"], "file"));
  EXPECT_EQ(by_run(told["mismatch"]["channels"], "run"), by_run(as_sorted["mismatch"]["channels"], "run"));
  // Lists side by side: each run has kept its own.
  const auto places = [](const json& mismatch) {
    std::map<std::string, json> all;
    for (std::size_t i = 0; i < mismatch["runs"].size(); ++i) all[mismatch["runs"][i]] = {mismatch["time"][i], mismatch["frequency"][i], mismatch["depends_on"][i]};
    return all;
  };
  EXPECT_EQ(places(told["mismatch"]), places(as_sorted["mismatch"]));
  std::vector<std::string> files;
  for (std::size_t i = 0; i < 3; ++i) files.push_back(told["improvement"]["runs"][i]["file"]);
  EXPECT_EQ(files, files_of(shuffled.runs));
}

TEST(RunOrder, GoesByWhatTheRunsHold) {
  const std::vector<unrig::Run> runs = runs_of("null", {"step_c", "step_b", "step_a", "wet_pluck", "dry_pluck"});
  EXPECT_EQ(order_of_search(runs), (std::vector<std::size_t>{4, 3, 2, 1, 0}));
  std::vector<unrig::Run> renamed = runs;
  for (std::size_t i = 0; i < runs.size(); ++i) renamed[i].file = std::to_string(runs.size() - i);
  EXPECT_EQ(order_of_search(renamed), order_of_search(runs)) << "not by the files' names";
  for (unrig::Run& run : renamed) run.file = "";
  EXPECT_EQ(order_of_search(renamed), (std::vector<std::size_t>{0, 1, 2, 3, 4})) << "runs that cannot be told apart stay where they are";
}

}  // namespace
}  // namespace unrig
