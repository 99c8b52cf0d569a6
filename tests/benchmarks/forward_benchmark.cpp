// The forward model: time per sample, with and without its derivatives, for the rig of the sample campaign (5 normal modes and 1 torsional one, 3 strips,
// Wagner's function within 1e-4).

#include <benchmark/benchmark.h>

#include "core/model/aeroelastic_model.h"
#include "core/propagate/exact_step.h"
#include "core/run/motion.h"
#include "core/propagate/response.h"
#include "tests/support/sample_data.h"

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double dt = 0.002;

struct Model {
  LinearSystem system;
  ExactStep step;
  DualMatrix start;
};

Model make_model(double speed, bool pitch) {
  const Rig rig = read_rig(test::null_campaign("rig.toml"));
  const AeroelasticModel model(rig, make_basis(rig, 0.5 / dt, 998.2), wagner(Wagner::within_1e4));
  Conditions conditions;
  conditions.density = 998.2;
  conditions.speed = speed;
  conditions.prescribed_pitch = pitch;
  Model m;
  m.system = model.system(conditions, model.start_values(), {"gauge"});
  m.step = exact_step(m.system, dt);
  m.start = DualMatrix(MatrixXd(VectorXd::Constant(m.system.states(), 1e-3)), m.system.A.parameters());
  return m;
}

void count(benchmark::State& state, const Model& m, Index samples) {
  state.SetItemsProcessed(state.iterations() * samples);
  state.counters["states"] = static_cast<double>(m.system.states());
  state.counters["time per sample"] =
      benchmark::Counter(static_cast<double>(samples), benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
}

/// A free decay, or a step once the shaft has come to rest.
void coast_in(benchmark::State& state, double speed, Partials partials) {
  const Model m = make_model(speed, false);
  const Index samples = state.range(0);
  for (auto _ : state) benchmark::DoNotOptimize(coast(m.system, m.step, m.start, samples, partials).output.data());
  count(state, m, samples);
}
BENCHMARK_CAPTURE(coast_in, still_water, 0.0, Partials::none)->Arg(3000)->Arg(30000);
BENCHMARK_CAPTURE(coast_in, stream, 0.6, Partials::none)->Arg(3000)->Arg(30000);
BENCHMARK_CAPTURE(coast_in, stream_with_derivatives, 0.6, Partials::all)->Arg(3000)->Arg(30000);

/// A shaft that turns all the time.
void drive_in(benchmark::State& state, Partials partials) {
  const Model m = make_model(0.6, true);
  const Index samples = state.range(0);
  const VectorXd jerk = motion_of(VectorXd::LinSpaced(samples, 0, 0.1).array().sin().matrix(), dt).jerk;
  for (auto _ : state) benchmark::DoNotOptimize(drive(m.system, m.step, m.start, samples, jerk, {}, partials).output.data());
  count(state, m, samples);
}
BENCHMARK_CAPTURE(drive_in, stream, Partials::none)->Arg(3000)->Arg(30000);
BENCHMARK_CAPTURE(drive_in, stream_with_derivatives, Partials::all)->Arg(3000);

/// What comes before: the model's matrices and their exponential, with all derivatives.
void set_up(benchmark::State& state) {
  const Rig rig = read_rig(test::null_campaign("rig.toml"));
  const AeroelasticModel model(rig, make_basis(rig, 0.5 / dt, 998.2), wagner(Wagner::within_1e4));
  Conditions conditions;
  conditions.density = 998.2;
  conditions.speed = 0.6;
  conditions.prescribed_pitch = true;
  for (auto _ : state) benchmark::DoNotOptimize(exact_step(model.system(conditions, model.start_values(), {"gauge"}), dt).transition.value.data());
}
BENCHMARK(set_up)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace unrig
