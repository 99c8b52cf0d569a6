// Five runs of the sample campaign, fitted together: 0.2 s of processor time, all threads counted.

#include <benchmark/benchmark.h>

#include "fit/fit.h"
#include "tests/support/sample_data.h"

namespace unrig {
namespace {

FitProblem null_problem(const std::vector<std::string>& runs) {
  FitProblem problem;
  problem.rig = read_rig(test::null_campaign("rig.toml"));
  for (const std::string& run : runs) problem.runs.push_back(read_run(test::null_campaign(run + ".csv")));
  return problem;
}

void fit_five_runs(benchmark::State& state) {
  const FitProblem problem = null_problem({"dry_pluck", "wet_pluck", "step_a", "step_b", "step_c"});
  for (auto _ : state) benchmark::DoNotOptimize(fit(problem).chi2);
}
BENCHMARK(fit_five_runs)->MeasureProcessCPUTime()->Unit(benchmark::kMillisecond);

void fit_two_decays(benchmark::State& state) {
  const FitProblem problem = null_problem({"dry_pluck", "wet_pluck"});
  for (auto _ : state) benchmark::DoNotOptimize(fit(problem).chi2);
}
BENCHMARK(fit_two_decays)->MeasureProcessCPUTime()->Unit(benchmark::kMillisecond);

void read_a_run(benchmark::State& state) {
  for (auto _ : state) benchmark::DoNotOptimize(read_run(test::null_campaign("step_a.csv")).samples());
}
BENCHMARK(read_a_run)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace unrig
