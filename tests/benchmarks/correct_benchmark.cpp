// The load of a rigid rig out of one run of 3000 samples: below 0.1 s on one core.

#include <benchmark/benchmark.h>

#include <filesystem>

#include "core/text_file.h"
#include "correct/correct.h"
#include "fit/fit.h"
#include "tests/support/sample_data.h"

namespace unrig {
namespace {

FittedRig fitted_rig(const Rig& rig) {
  FitProblem problem;
  problem.rig = rig;
  for (const std::string run : {"dry_pluck", "wet_pluck", "step_a", "step_b", "step_c"}) problem.runs.push_back(read_run(test::null_campaign(run + ".csv")));
  const std::string file = (std::filesystem::temp_directory_path() / "unrig_correct_benchmark.json").string();
  write_text(file, to_json(fit(problem)));
  const FittedRig fitted = read_fit(file);
  std::filesystem::remove(file);
  return fitted;
}

void correct_a_run(benchmark::State& state, const char* run) {
  const Rig rig = read_rig(test::null_campaign("rig.toml"));
  const CorrectProblem problem{rig, fitted_rig(rig), read_run(test::null_campaign(run))};
  for (auto _ : state) benchmark::DoNotOptimize(correct(problem).slope);
}
BENCHMARK_CAPTURE(correct_a_run, step_a, "step_a.csv")->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(correct_a_run, step_c, "step_c.csv")->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(correct_a_run, heldout, "heldout.csv")->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace unrig
