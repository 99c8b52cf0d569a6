#pragma once
#include <Eigen/Core>

#include "core/model/aeroelastic_model.h"

namespace unrig {

/// Parameters of a beam rig, in the order of theta.
enum BeamParameter : Eigen::Index { normal_stiffness, torsion_stiffness, normal_damping, torsion_damping, apparent_mass, force_slope, beam_parameter_count };
/// Of a rig known as modes, per mode: mass, stiffness, damping, mount participation.
constexpr Eigen::Index per_modal_mode = 4;

/// Column positions of the extended coordinates' displacement, rate and acceleration in the state and the inputs.
/// Prescribed coordinates have theirs in the motion states (pitch) and in the inputs (heave).
struct Layout {
  Eigen::Index coordinates, lags, motion, states, inputs, force = -1, mount = -1, strip_port = -1, coordinate_port = -1;
};

inline Layout layout_of(Eigen::Index coordinates, Eigen::Index lags, Eigen::Index strips, const Conditions& conditions) {
  Layout l{coordinates, lags, -1, 2 * coordinates + lags, 0};
  if (conditions.prescribed_pitch) {
    l.motion = l.states;
    l.states += 3;
  }
  if (conditions.force) l.force = l.inputs++;
  if (conditions.mount) {
    l.mount = l.inputs;
    l.inputs += 2;
  }
  if (conditions.ports) {
    l.strip_port = l.inputs;
    l.coordinate_port = l.strip_port + strips;
    l.inputs = l.coordinate_port + coordinates;
  }
  return l;
}

}  // namespace unrig
