// The load of a rigid rig out of one run of 3000 samples, and out of long ones: a step of 1.5 degrees within 60 ms and a rest behind it, or two of them; shafts that never
// rest.

#include <benchmark/benchmark.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <numbers>
#include <random>

#include "core/model/simulate.h"
#include "core/files/text_file.h"
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

void add_noise(Eigen::VectorXd& value, double sigma, unsigned seed) {
  std::mt19937_64 engine(seed);
  std::normal_distribution<double> normal(0, sigma);
  for (double& x : value) x += normal(engine);
}

/// Smooth steps up and down in turn, evenly over the record, with the noise of the sample campaign.
Run long_run(const Rig& rig, const FittedRig& fitted, Eigen::Index samples, Eigen::Index steps) {
  constexpr double degree = std::numbers::pi / 180, duration = 0.06;
  Run run;
  run.file = "long.csv";
  run.density = 998.2;
  run.speed = 0.6096;
  run.dt = 0.002;
  Eigen::VectorXd alpha = Eigen::VectorXd::Constant(samples, 2.09 * degree);
  for (Eigen::Index i = 0; i < steps; ++i) {
    const double start = 0.4 + run.dt * static_cast<double>(i * samples / steps);
    for (Eigen::Index k = 0; k < samples; ++k) {
      const double s = std::clamp((run.time(k) - start) / duration, 0.0, 1.0);
      alpha[k] += (i % 2 == 0 ? 1.5 : -1.2) * degree * s * s * s * (10 - 15 * s + 6 * s * s);
    }
  }
  run.channels.push_back({"alpha", "rad", "rad", 1, alpha});
  const AeroelasticModel model(rig, make_basis(rig, fitted.normal_modes, fitted.torsion_modes), wagner(fitted.circulation));
  Run simulated = simulate({model, theta_for(model, fitted, "step_a.csv"), run, PitchBetweenSamples::spline, {}, {}}).run;
  for (Channel& channel : simulated.channels) {
    if (channel.name == "alpha") add_noise(channel.value, 1.8e-4, 1);
    if (channel.name == "gauge") add_noise(channel.value, 0.027, 2);
  }
  return simulated;
}

void correct_a_long_run(benchmark::State& state) {
  const Rig rig = read_rig(test::null_campaign("rig.toml"));
  const FittedRig fitted = fitted_rig(rig);
  const CorrectProblem problem{rig, fitted, long_run(rig, fitted, state.range(0), state.range(1))};
  for (auto _ : state) benchmark::DoNotOptimize(correct(problem).slope);
}
BENCHMARK(correct_a_long_run)->ArgNames({"samples", "steps"})->Args({10000, 1})->Args({100000, 1})->Args({1000000, 1})->Args({1000000, 2})->Unit(benchmark::kMillisecond);

/// Motions that never rest, with a soft start.
double soft(double x) { return x <= 0 ? 0 : x >= 1 ? 1 : x * x * x * (10 - 15 * x + 6 * x * x); }
double sine(double t, double) { return 2 * std::sin(2 * std::numbers::pi * 1.5 * t); }
double twelve_frequencies(double t, double) {
  double sum = 0;
  for (int i = 1; i <= 12; ++i) sum += std::sin(2 * std::numbers::pi * 0.41 * i * (1 + 1e-3 * std::sqrt(i)) * t + 2.39996 * i * i) / i;
  return 1.5 * sum;
}
double chirp(double t, double duration) {
  constexpr double first = 0.2, last = 5;  // Hz
  const double growth = std::log(last / first);
  return 2 * std::sin(2 * std::numbers::pi * first * duration / growth * std::expm1(t / duration * growth));
}

/// With counters: r.m.s. error of the circulatory load over its range, samples inside their 95 % band, all and in the worst tenth of the record.
void correct_a_restless_run(benchmark::State& state, double (*motion)(double t, double duration)) {
  constexpr double degree = std::numbers::pi / 180;
  const Rig rig = read_rig(test::null_campaign("rig.toml"));
  const FittedRig fitted = fitted_rig(rig);
  const Eigen::Index samples = state.range(0);
  Run run;
  run.file = "restless.csv";
  run.density = 998.2;
  run.speed = 0.6096;
  run.dt = 0.002;
  Eigen::VectorXd alpha(samples);
  for (Eigen::Index k = 0; k < samples; ++k) alpha[k] = (2 + soft((run.time(k) - 0.2) / 0.3) * motion(run.time(k) - 0.2, run.dt * static_cast<double>(samples))) * degree;
  run.channels.push_back({"alpha", "rad", "rad", 1, alpha});
  const AeroelasticModel model(rig, make_basis(rig, fitted.normal_modes, fitted.torsion_modes), wagner(Wagner::within_1e6));
  Eigen::VectorXd theta = theta_for(model, fitted, "");
  theta[model.index("normal_force_slope")] = 5.86;
  CorrectProblem problem{rig, fitted, simulate({model, theta, run, PitchBetweenSamples::spline, {}, {}}).run};
  Eigen::VectorXd truth;
  for (Channel& channel : problem.run.channels) {
    if (channel.name == "alpha") add_noise(channel.value, 0.01 * degree, 1);
    if (channel.name == "gauge") add_noise(channel.value, 0.027, 2);
    if (channel.name == "circulatory") truth = channel.value;
  }
  for (auto _ : state) {
    const CorrectedLoad load = correct(problem).circulatory;
    const Eigen::ArrayXd off = (load.value - truth).cwiseAbs();
    const Eigen::ArrayXd inside = (off < 1.96 * load.std.array()).cast<double>();
    double worst = 1;
    for (Eigen::Index tenth = 0; tenth < 10; ++tenth) worst = std::min(worst, inside.segment(tenth * samples / 10, samples / 10).mean());
    state.counters["error"] = std::sqrt(off.square().mean()) / (truth.maxCoeff() - truth.minCoeff());
    state.counters["inside"] = inside.mean();
    state.counters["worst_tenth"] = worst;
  }
}
BENCHMARK_CAPTURE(correct_a_restless_run, sine, &sine)->ArgName("samples")->Arg(10000)->Arg(100000)->Arg(1000000)->Unit(benchmark::kMillisecond)->MeasureProcessCPUTime();
BENCHMARK_CAPTURE(correct_a_restless_run, twelve_frequencies, &twelve_frequencies)->ArgName("samples")->Arg(10000)->Arg(100000)->Arg(1000000)->Unit(benchmark::kMillisecond)->MeasureProcessCPUTime();
BENCHMARK_CAPTURE(correct_a_restless_run, chirp, &chirp)->ArgName("samples")->Arg(10000)->Arg(100000)->Unit(benchmark::kMillisecond)->MeasureProcessCPUTime();

}  // namespace
}  // namespace unrig
