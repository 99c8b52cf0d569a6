// Laws from a file beside the compiled effects that say the same: the law alone with its derivatives, and a run of the sample rig that it bends, with all partials.

#include <benchmark/benchmark.h>

#include "core/propagate/feedback_force.h"
#include "core/law/law_effect.h"
#include "core/propagate/nonlinear_response.h"
#include "tests/support/sample_data.h"

namespace unrig {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double dt = 0.002;

const char* file_of(const std::string& effect) {
  if (effect == "bouc-wen")
    return "unrig_law = 1\nname = \"l\"\nacts_on = \"normal\"\nforce = \"-f * z\"\nmemory = \"v / xy * (1 - (b + (1 - b) * sign(v * z)) * abs(z)^n)\"\n"
           "[parameters]\nf = { start = \"8 N\" }\nxy = { start = \"2 mm\", lower = \"1e-6 m\" }\nb = { start = 0.4 }\nn = { start = 1.3 }\n";
  if (effect == "coulomb-friction")
    return "unrig_law = 1\nname = \"l\"\nacts_on = \"normal\"\nforce = \"-c * tanh(v / s)\"\n[parameters]\nc = { start = \"1 N\" }\ns = { start = \"3 mm/s\" }\n";
  return "unrig_law = 1\nname = \"l\"\nacts_on = \"normal\"\nforce = \"-k * ((x + d)^3 - d^3)\"\n[parameters]\nk = { start = \"1e6 N/m^3\" }\nd = { start = \"0.1 mm\" }\n";
}

struct Work {
  VectorXd theta;
  LinearSystem system;
};

Work work_of(const std::string& effect, bool from_file) {
  Rig rig = read_rig(test::null_campaign("rig.toml"));
  std::string id = effect;
  add_law(rig, parse_law(file_of(effect), "law.toml"));
  const VectorXd p = rig.laws.back()->starts.front();
  if (from_file) id = rig.laws.back()->id;
  const AeroelasticModel model = AeroelasticModel(rig, make_basis(rig, 0.5 / dt, 998.2), wagner(Wagner::within_1e4)).with_effects({id});
  Work work{model.start_values(), {}};
  work.theta.tail(p.size()) = p;
  Conditions conditions;
  conditions.density = 998.2;
  work.system = model.system(conditions, work.theta, {"gauge"});
  return work;
}

void law_alone(benchmark::State& state, const char* effect, bool from_file) {
  const Work work = work_of(effect, from_file);
  const Feedback& feedback = work.system.feedback.front();
  double z[] = {0.01, 0.3};
  for (auto _ : state) {
    z[0] = -z[0];
    benchmark::DoNotOptimize(force_of(feedback, z, work.theta));
  }
}

void bent_run(benchmark::State& state, const char* effect, bool from_file) {
  const Work work = work_of(effect, from_file);
  const ExactStep step = step_to_follow(work.system, dt);
  VectorXd start = VectorXd::Zero(work.system.states());
  start[0] = 1e-3;
  constexpr Eigen::Index samples = 3000;
  for (auto _ : state)
    benchmark::DoNotOptimize(follow(work.system, step, work.theta, {start, {}, MatrixXd(samples + 1, 0), MatrixXd(work.system.states(), 0), {}}, samples, Partials::all).output.data());
  state.SetItemsProcessed(state.iterations() * samples);
}

#define BOTH(what, name, effect)                       \
  BENCHMARK_CAPTURE(what, name##_compiled, effect, false); \
  BENCHMARK_CAPTURE(what, name##_from_file, effect, true)
BOTH(law_alone, cubic, "cubic-stiffness");
BOTH(law_alone, friction, "coulomb-friction");
BOTH(law_alone, hysteresis, "bouc-wen");
BOTH(bent_run, cubic, "cubic-stiffness");
BOTH(bent_run, friction, "coulomb-friction");
BOTH(bent_run, hysteresis, "bouc-wen");

}  // namespace
}  // namespace unrig
