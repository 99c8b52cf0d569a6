#include "core/model/simulate.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <vector>

#include "core/propagate/exact_step.h"
#include "core/law/learnt_range.h"
#include "core/rig/bridge.h"
#include "core/model/ideal_step.h"
#include "core/run/motion.h"
#include "core/propagate/nonlinear_response.h"
#include "core/propagate/response.h"
#include "core/propagate/static_state.h"
#include "core/model/rigid_system.h"
#include "core/model/run_inputs.h"

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

struct Simulated {
  std::string name, unit;
};

/// The gauge and every sensor, whether the run has recorded them or not.
std::vector<Simulated> outputs_of(const Rig& rig, const Run& run) {
  std::vector<Simulated> outputs;
  if (rig.has_gauge()) outputs.push_back({"gauge", rig.gauge_unit()});
  for (const Sensor& sensor : rig.sensors) {
    const Channel* recorded = run.find(sensor.column);
    outputs.push_back({sensor.column, recorded ? recorded->unit : sensor.unit});
  }
  return outputs;
}

/// The column of that name, new or instead of the recorded one.
void put(Run& run, const std::string& name, const std::string& unit, const VectorXd& value) {
  const auto found = std::find_if(run.channels.begin(), run.channels.end(), [&](const Channel& c) { return c.name == name; });
  Channel& channel = found == run.channels.end() ? run.channels.emplace_back() : *found;
  // A recorded column in another unit of the same kind ("lbf") keeps it; run_text leaves it where a calibration lay between.
  const bool keeps_unit = found != run.channels.end() && channel.unit == unit;
  channel.name = name;
  if (!keeps_unit) channel.file_unit = unit, channel.factor = 1;
  channel.unit = unit;
  channel.value = value;
  channel.missing = 0;
}

Conditions conditions_for(const SimulateProblem& problem) {
  Conditions conditions = conditions_of(problem.run);
  const Run& run = problem.run;
  const InputError::Place place{run.file, 0};
  const Rig& rig = problem.model.rig();
  if (run.kind == RunKind::step && !rig.is_modal()) {
    const Channel& alpha = run.channel("alpha");
    for (Index k = 0; k < run.samples(); ++k)
      if (!std::isfinite(alpha.value[k]))
        throw InputError(place, fmt::format("alpha has no number at {:.6g} s", run.time(k)),
                         "wanted the angle of the shaft in every sample", "");
  }
  if (run.kind == RunKind::pluck && !problem.release_load)
    throw InputError(place, "a pluck is let go from somewhere", "wanted the load it is released from", "Give --release-load \"20 N\".");
  if (run.kind == RunKind::forced) run.channel("force");
  if (run.kind == RunKind::moved && !conditions.mount) run.channel("mount_acceleration");
  if (problem.release_load) {
    if (run.kind == RunKind::step)
      throw InputError(place, "a release load for a step", "wanted it for a pluck",
                       "A step starts in the steady state of its first angle.");
    if (!rig.takes_force())
      throw InputError({rig.file, 0}, "the rig has no calibration element for the release load", "wanted [gauge] with calibration_element",
                       "");
    conditions.force = true;
  }
  return conditions;
}

/// A shaft that jumps: between jumps the pitch is constant, at a jump the states jump too.
MatrixXd jump_response(const LinearSystem& system, const VectorXd& angle, double dt) {
  const MatrixXd transition = exact_step(system, dt).transition.value;
  const VectorXd jump = step_jump(system);
  VectorXd state = VectorXd::Zero(system.states());
  MatrixXd output(angle.size(), system.C.rows());
  for (Index k = 0; k < angle.size(); ++k) {
    if (k > 0) {
      state = transition * state;
      if (angle[k] != angle[k - 1]) state += (angle[k] - angle[k - 1]) * jump;
    }
    output.row(k) = (system.C.value * state).transpose();
  }
  return output;
}

MatrixXd response_to_pitch(const LinearSystem& system, const VectorXd& angle, double dt, PitchBetweenSamples pitch) {
  if (pitch == PitchBetweenSamples::jumps) return jump_response(system, angle, dt);
  return motion_response(system, interpolated_motion(angle, dt), dt);
}

/// Where the run starts: static deflection, signals, and the spline's acceleration.
VectorXd start_of(const SimulateProblem& problem, const LinearSystem& system, const Motion& motion) {
  VectorXd start = VectorXd::Zero(system.states());
  if (problem.release_load) start = static_state(system, *problem.release_load * system.B.value.col(0));
  if (problem.signals.size() > 0) {
    if (problem.signals.size() != static_cast<Index>(system.exogenous.size()))
      throw std::invalid_argument(fmt::format("{} values for the {} signal states of the effects", problem.signals.size(), system.exogenous.size()));
    start(system.exogenous) = problem.signals;
  }
  if (motion.jerk.size() > 0) start.segment(system.motion, 3) << motion.angle[0], motion.rate[0], motion.acceleration[0];
  return start;
}

/// One sample after the other, so that the signals can change in between.
MatrixXd response_with_steps(const SimulateProblem& problem, const LinearSystem& system, const ExactStep& step, VectorXd state, const VectorXd& jerk, const MatrixXd& input) {
  const Index samples = problem.run.samples();
  if (problem.signal_steps.rows() != samples || problem.signal_steps.cols() != static_cast<Index>(system.exogenous.size()))
    throw std::invalid_argument(fmt::format("steps of {} signals in {} samples, of {} signals in {} samples", problem.signal_steps.cols(), problem.signal_steps.rows(), system.exogenous.size(), samples));
  MatrixXd output(samples, system.C.rows());
  NonlinearDrive from{std::move(state), {}, MatrixXd(2, 0), MatrixXd(system.states(), 0), {}};
  for (Index k = 0; k < samples; ++k) {
    if (jerk.size() > 0) from.jerk = jerk.segment(k, 1);
    if (input.cols() > 0) from.input = input.middleRows(k, 2);
    const NonlinearResponse response = follow(system, step, problem.theta, from, 1, Partials::none);
    if (!response.finite) throw NoAnswer(problem.run.file + ": the response with its nonlinear effects grows beyond all bounds");
    output.row(k) = response.output;
    from.start = response.end;
    from.start(system.exogenous) += problem.signal_steps.row(k).transpose();
  }
  return output;
}

/// Of motion, measured inputs and start in one pass: with nonlinear effects they do not add up. Jumps are added by themselves, to a linear system.
MatrixXd response_of(const SimulateProblem& problem, const LinearSystem& system, const Conditions& conditions) {
  const Run& run = problem.run;
  const bool jumps = system.motion >= 0 && problem.pitch == PitchBetweenSamples::jumps;
  if (jumps && !system.feedback.empty())
    throw InputError({run.file, 0}, "the angle jumps while a nonlinear effect is at work", "wanted only linear effects for ideal steps", "Leave out --jumps, or the effect.");
  const Motion motion = system.motion >= 0 && !jumps ? interpolated_motion(run.channel("alpha").value, run.dt) : Motion{};
  const MatrixXd input = run_inputs(run, conditions);
  const VectorXd start = start_of(problem, system, motion);
  if (jumps && problem.signal_steps.size() > 0) throw std::invalid_argument("signals that step, and a shaft that jumps");
  if (problem.signal_steps.size() > 0) return response_with_steps(problem, system, step_to_follow(system, run.dt), start, motion.jerk, input);
  if (!system.feedback.empty()) {
    const NonlinearResponse response = follow(system, step_to_follow(system, run.dt), problem.theta, {start, motion.jerk, input, MatrixXd(system.states(), 0), {}}, run.samples(), Partials::none);
    if (!response.finite) throw NoAnswer(run.file + ": the response with its nonlinear effects grows beyond all bounds");
    return response.output;
  }
  MatrixXd output = drive(system, exact_step(system, run.dt), DualMatrix(start), run.samples(), motion.jerk, input.cols() > 0 ? input : MatrixXd(), Partials::none).output;
  if (jumps) output += jump_response(system, run.channel("alpha").value, run.dt);
  return output;
}

/// What gauge and sensors read, but for the steady state; which laws go beyond where they were learnt.
MatrixXd read_response(const SimulateProblem& problem, const LinearSystem& system, const Conditions& conditions, std::vector<std::string>& beyond) {
  LinearSystem with_sights = system;
  std::vector<Sight> sights = append_sights(with_sights, problem.model, conditions, Sights::learnt);
  const MatrixXd response = response_of(problem, with_sights, conditions);
  take_values(sights, response.rightCols(static_cast<Index>(sights.size())), problem.run.dt);
  beyond = beyond_learnt(sights, problem.run);
  return response.leftCols(system.C.rows());
}

/// Outputs in the steady state of the first angle.
VectorXd steady_reading(const SimulateProblem& problem, const LinearSystem& system, double angle) {
  VectorXd reading = angle * system.C.value.col(system.motion);
  reading += system.C.value * static_state(system, angle * system.A.value.col(system.motion));
  const Rig& rig = problem.model.rig();
  if (!problem.steady_normal_force) return reading;
  const auto steady = [&](const BridgeLevers& levers) { return *problem.steady_normal_force * reading_of_unit_coefficient(rig, levers, problem.run.density, problem.run.speed); };
  Index output = 0;
  if (rig.has_gauge()) reading[output++] = steady(gauge_levers(rig));
  for (const Sensor& sensor : rig.sensors) {
    if (sensor.reads == SensorKind::load) reading[output] = steady(bridge_levers(rig, sensor.element, sensor.row));
    ++output;
  }
  return reading;
}

void add_rigid_loads(const SimulateProblem& problem, const Conditions& conditions, SimulateResult& result) {
  const Run& run = problem.run;
  const Rig& rig = problem.model.rig();
  const LinearSystem rigid = rigid_system(problem.model, conditions, problem.theta);
  const VectorXd& angle = run.channel("alpha").value;
  const MatrixXd load = response_to_pitch(rigid, angle, run.dt, problem.pitch);
  const double span = rig.strip_length * static_cast<double>(rig.submerged.size());
  const double coefficient = problem.steady_normal_force.value_or(problem.theta[problem.model.index("normal_force_slope")] * angle[0]);
  const double steady = coefficient * run.density * run.speed * run.speed * rig.semichord() * span;
  for (const Index c : {0, 1}) {
    result.simulated.push_back(rigid.outputs[static_cast<std::size_t>(c)]);
    put(result.run, result.simulated.back(), "N", load.col(c).array() + steady);
  }
}

void warn_of_noise(const VectorXd& angle, std::vector<std::string>& warnings) {
  // Ten printed digits leave far less than a thousandth of the motion; a recording leaves more.
  const double noise = noise_level(angle), range = angle.maxCoeff() - angle.minCoeff();
  if (noise > 1e-3 * range)
    warnings.push_back(
        fmt::format("alpha carries noise of {:.2g} deg, whose second derivative becomes load; simulate needs the motion itself",
                    noise * 180 / std::numbers::pi));
}

}  // namespace

SimulateResult simulate(const SimulateProblem& problem) {
  const Run& run = problem.run;
  const Conditions conditions = conditions_for(problem);
  const std::vector<Simulated> outputs = outputs_of(problem.model.rig(), run);
  SimulateResult result;
  for (const Simulated& output : outputs) result.simulated.push_back(output.name);
  LinearSystem system = problem.model.system(conditions, problem.theta, result.simulated);
  for (DualMatrix* m : {&system.A, &system.B, &system.C, &system.D}) m->partial.clear();  // nobody asks for derivatives
  for (Feedback& f : system.feedback) f.steps_per_sample *= problem.law_steps;

  result.run = run;
  MatrixXd reading = read_response(problem, system, conditions, result.beyond);
  if (system.motion >= 0) {
    const VectorXd& angle = run.channel("alpha").value;
    if (problem.pitch == PitchBetweenSamples::spline) warn_of_noise(angle, result.warnings);
    reading.rowwise() += steady_reading(problem, system, angle[0]).transpose();
  }
  for (std::size_t c = 0; c < outputs.size(); ++c) put(result.run, outputs[c].name, outputs[c].unit, reading.col(static_cast<Index>(c)));
  if (system.motion >= 0) add_rigid_loads(problem, conditions, result);
  return result;
}

}  // namespace unrig
