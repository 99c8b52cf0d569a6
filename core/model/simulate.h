#pragma once
#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "core/model/aeroelastic_model.h"
#include "core/run/run.h"

namespace unrig {

/// How the prescribed pitch gets from one sample to the next.
enum class PitchBetweenSamples {
  spline,  ///< along the cubic spline through the samples, from rest
  jumps,   ///< not at all: an ideal step at every sample that differs from the one before (seed, Eq. 3.18-3.20)
};

/// What would gauge and sensors of this rig read in this run?
struct SimulateProblem {
  AeroelasticModel model;
  Eigen::VectorXd theta;  ///< parameters of the model, for this run
  Run run;                ///< conditions and inputs: alpha (of a step), force, mount_velocity, mount_acceleration
  PitchBetweenSamples pitch = PitchBetweenSamples::spline;
  std::optional<double> release_load;         ///< N at the calibration element, let go at the first sample (a pluck starts so)
  std::optional<double> steady_normal_force;  ///< coefficient before the motion; without it, slope times the first angle
  Eigen::VectorXd signals = {};  ///< initial values of the effects' signals (LinearSystem::exogenous), in their units; empty: all zero
  Eigen::MatrixXd signal_steps = {};  ///< what they change by behind each sample, beside what the model makes of them, samples x signals; empty: nothing; not with jumps
  Eigen::Index law_steps = 1;  ///< nonlinear laws are followed in so many times the steps that they ask for, as the fit was that they are from
};

struct SimulateResult {
  Run run;                             ///< the run with its simulated columns, those of the same name replaced
  std::vector<std::string> simulated;  ///< names of these columns
  std::vector<std::string> warnings;
  std::vector<std::string> beyond;     ///< laws at work that this run takes beyond where they were learnt, in words (core/law/learnt_range.h)
};

/// Runs the coupled model, without noise and offsets.
///
/// Simulated are the gauge, every sensor of the rig, and, of a step, the loads that a perfectly rigid rig would feel: `circulatory` and
/// `normal_force`. A step starts in the steady state of its first angle, a pluck in the static deflection under `release_load`, anything
/// else at rest. The steady state is that of the linear model, x = -A^-1 A_p p, so that a rig whose strips lift ahead of its pitch axis
/// stands twisted; the angle it starts from must be small for this to make sense, otherwise give `steady_normal_force`.
///
/// Nonlinear effects are followed together with motion, inputs and start in one pass (core/propagate/nonlinear_response.h). A pluck is released from the static
/// deflection of the linear model: with a cubic spring or a gap at work the true one differs.
///
/// A law that goes beyond the range that it was learnt on is followed all the same, and said in `beyond`: whoever asks decides.
///
/// At a jump the reading itself has delta functions, which no sample can show; the sample at the jump holds the limit from the right.
///
/// Throws InputError where the run lacks what its kind needs: a number in every sample of alpha (step), a release load (pluck), the inputs
/// of a forced or moved run; for a release load where the rig has no calibration element; for jumps where a nonlinear effect is at work. NoAnswer where a
/// nonlinear response is not finite.
SimulateResult simulate(const SimulateProblem& problem);

}  // namespace unrig
