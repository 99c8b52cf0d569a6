#pragma once
#include <Eigen/Core>
#include <optional>
#include <vector>

#include "core/model/aeroelastic_model.h"

namespace unrig {

/// Stiffness scales and apparent-mass coefficient (k_n, k_t, C_a): all that natural frequencies of a rig of known masses depend on.
using RigScales = Eigen::Vector3d;

/// Natural frequencies of a rig in still fluid, ascending, and their exact derivatives: with K phi = omega^2 M phi and phi^T M phi = 1
///
///   d omega^2 = phi^T (dK - omega^2 dM) phi
///
/// (R. L. Fox and M. P. Kapoor, AIAA J. 6 (1968) 2426, for frequencies that are distinct).
struct NaturalFrequencies {
  Eigen::VectorXd hertz;
  Eigen::MatrixX3d slope;  ///< d hertz / d (k_n, k_t, C_a)
  Eigen::MatrixXd shape;   ///< columns phi
};
NaturalFrequencies natural_frequencies(const UndampedSystem& system, const RigScales& scales);

/// A vibration seen in a run, to be held against the rig's natural frequencies.
struct ObservedFrequency {
  double hertz = 0;      ///< natural: |pole| / 2 pi
  double std_error = 0;  ///< Hz
  double decay = 0;      ///< 1/s
  double strength = 0;   ///< in one unit for all of the run
  std::optional<Eigen::Index> mode;  ///< of the rig, from 0, where it could be matched
  int folded = 0;        ///< the mode vibrates above the Nyquist frequency and was folded down this many times; `hertz` is where it truly is
};

struct ObservedRun {
  UndampedSystem system;
  double sampling = 0;  ///< Hz
  std::vector<ObservedFrequency> observed;
};

/// Scales of a rig from frequencies seen dry and wet.
struct FrequencyFit {
  RigScales scales;
  Eigen::Matrix3d covariance;       ///< of `scales`, after `error_scale`
  double reduced_chi2 = 0;          ///< with the frequencies' own errors; 0 where nothing is left over
  Eigen::Index degrees_of_freedom = 0;
  double error_scale = 1;           ///< factor by which the frequencies' errors had to grow for a reduced chi-square of one
  bool torsion_identified = false;  ///< the frequencies say more about k_t than the prior does
};

/// Matches the observed frequencies of both runs to the rig's modes and fits (k_n, k_t, C_a) to all that match, by least squares in units of their
/// errors. `dry` and `wet` come back with `mode` filled in.
///
/// The rig file's stiffness may be far off: the lowest mode is tied in turn to each strong vibration of either run, which settles k_n and C_a,
/// k_t / k_n is scanned from 1/16 to 16, and the scales win under which most frequencies lie within 4 % of a mode of their own. After a first fit
/// in which all count alike, those within 3 % stay. The others are left out: tones, waves, modes of the room.
///
/// Prior, for rigs whose torsion was not heard: k_t / k_n is that of the rig file to within a factor e^(+-0.5).
/// Where the reduced chi-square exceeds one, the model's frequencies are off by more than the measurement: all errors grow by one factor.
///
/// Returns nothing where no scales put the lowest mode on an observed frequency in both runs.
std::optional<FrequencyFit> fit_rig_frequencies(ObservedRun& dry, ObservedRun& wet);

}  // namespace unrig
