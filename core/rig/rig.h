#pragma once
#include <Eigen/Core>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/files/error.h"
#include "core/rig/gauge_filter.h"

namespace unrig {

struct Effect;
struct Givens;

/// A chain of lumped elements, clamped at its first end (seed, section 3.1): normal displacement or twist.
struct Chain {
  Eigen::VectorXd inertia;          ///< mass per element [kg], or moment of inertia about the pitch axis [kg m^2]
  Eigen::MatrixXd flexibility;      ///< A_ij: deflection of i per unit load at j [m/N or rad/(N m)] (seed, Eq. 3.2), symmetrised
  Eigen::MatrixXd flexibility_std;  ///< standard deviation of a measured flexibility, empty where none is given
  int modes = 0;                    ///< modes to keep; 0 = all below the run's Nyquist frequency
};

/// What a further channel measures (correct/manual/rig_files.md).
enum class SensorKind { displacement, velocity, acceleration, twist, twist_rate, load };

/// A row of a balance's calibration matrix: what a bridge reads per unit of the loads outboard of it (core/rig/bridge.h), in SI.
struct CalibrationRow {
  double per_force = 0;           ///< normal force [N]
  double per_bending_moment = 0;  ///< at the bridge [N m], positive where a positive normal force bends it
  double per_torque = 0;          ///< about the pitch axis, nose up [N m]
};

struct Sensor {
  std::string column;
  SensorKind reads = SensorKind::displacement;
  int element = 1;  ///< from 1, in the normal chain, or in the torsion chain for twist and twist_rate
  double gain = 1;  ///< column (SI) per unit of the model's quantity (SI); of a load 1
  std::string unit;  ///< SI unit of the column: the quantity's, times the gain's where the gain has one ("0.5 V/m")
  CalibrationRow row = {};  ///< of a load
};

/// One mode of a rig that is known only as modes.
struct ModalMode {
  double mass = 1;       ///< kg
  double frequency = 0;  ///< Hz, in vacuum
  double damping_ratio = 0;
  double gauge_gain = 1;   ///< gauge reading per metre of modal displacement, SI
  std::string gauge_unit;  ///< SI unit of the reading ("N", "rad", "N.m")
  std::vector<double> sensor_shape = {};  ///< displacement or twist at each of the rig's sensors, per unit of the modal displacement
};

/// A structure, in SI (correct/manual/rig_files.md). Either `modal` is filled, or the two chains and what belongs to them.
struct Rig {
  std::string file;
  std::string name;

  double chord = 0;             ///< m
  double pitch_axis = 0;        ///< fraction of the chord aft of the leading edge
  Eigen::VectorXd station;      ///< m from the clamp, one per normal element
  Eigen::VectorXd mass_centre;  ///< m aft of the pitch axis, one per normal element
  Chain normal;
  Chain torsion;
  int rigid_from = 0;           ///< torsion element (from 1) that carries the normal elements of the same number and all outboard
  std::vector<int> submerged;   ///< normal elements (from 1) that are strips
  double strip_length = 0;      ///< m
  int gauge_element = 0;        ///< from 1; 0: no gauge, or a rig known as modes
  int calibration_element = 0;  ///< from 1
  int loaded_element() const { return calibration_element > 0 ? calibration_element : 1; }  ///< where a single force acts: of a rig without a gauge the first
  double calibration_uncertainty = 0;        ///< of the gauge, relative, one standard deviation
  std::vector<GaugeFilter> gauge_filters;    ///< between bridge and record, where they are known

  std::vector<Sensor> sensors;
  std::vector<ModalMode> modal;
  std::vector<std::shared_ptr<const Effect>> laws;  ///< that a user wrote down; effects of this rig beside those of the table
  Eigen::Index deviations = 0;  ///< errors of its numbers and of its runs' heads that are parameters of its models, in standard deviations (core/run/deviation_slopes.h)
  std::shared_ptr<const Givens> givens;             ///< stated uncertainties of the numbers above; none: all are exact
  std::vector<std::string> warnings;

  bool is_modal() const { return !modal.empty(); }
  bool has_gauge() const { return gauge_element > 0 || (is_modal() && modal.front().gauge_gain != 0); }
  /// What the gauge reads in, in SI.
  std::string gauge_unit() const { return is_modal() ? modal.front().gauge_unit : "N"; }
  /// Whether it says where a single force acts: on every mode, or at the calibration element.
  bool takes_force() const { return is_modal() || calibration_element > 0; }
  double semichord() const { return chord / 2; }
  /// Position of the pitch axis in semichords aft of mid-chord (a_h of the seed's Figure 2.2): -1/2 at the quarter chord.
  double axis() const { return 2 * pitch_axis - 1; }
};

/// Reads a rig file (correct/manual/rig_files.md). Throws InputError (file, line, key, found, wanted) for unknown keys, wrong units, mismatched
/// lengths, elements out of range, and a flexibility matrix that is not symmetric or not positive definite within the rounding of its
/// printed digits.
///
/// Among its keys:
///
/// A flexibility that was *measured*: what its scatter explains is accepted as symmetric and positive definite:
///
///     flexibility.std_percent = 2.0        # one standard deviation, in percent of every entry; or
///     flexibility.std_rows = [[..], ..]    # of each entry, in the unit and scale of flexibility.rows
///
/// How well the gauge was calibrated, and an amplifier in its channel that is known; simulate, fit and correct take account of it (core/rig/rig_gauge.h):
///
///     [gauge]
///     calibration_uncertainty = 0.005      # one standard deviation, as a fraction of the reading
///     lowpass = { order = 2, cutoff = "30 Hz", damping_ratio = 0.7 }   # order 1 has no damping ratio; default 1/sqrt(2)
///     response = "amplifier.csv"           # measured: columns frequency [Hz], gain [1], phase [deg]; beside the rig file
///     delay = "2 ms"                       # the gauge's column is late
///
/// A rig *from its drawings*, without `flexibility`, by virtual work (core/rig/beam_flexibility.h):
///
///     [normal]
///     length.unit = "in"                   # the elements' lengths, end to end from the clamp; each station lies in its element
///     length.values = [..]
///     youngs_modulus = "70 GPa"            # of all elements; or youngs_modulus.unit and .values
///     second_moment.unit = "m^4"           # second moment of area of each cross-section; or one for all
///     second_moment.values = [..]
///     clamp_spring = "2e5 N.m/rad"         # optional: the clamp turns
///     clamp_translation = "1e8 N/m"        # optional: the clamp gives
///
///     [torsion]
///     length.unit = "in"                   # optional: default the normal elements' of the same number, and so for `station`
///     length.values = [..]
///     shear_modulus = "26 GPa"
///     polar_moment.unit = "m^4"            # J of each cross-section (seed, Eq. A.2); or, instead of it,
///     polar_moment.values = [..]
///     section = [                          # the cross-sections (seed, Eqs. A.2, A.3), one per element; or one table for all
///         { shape = "circular", diameter = "1.5 in" },
///         { shape = "rectangular", a = "0.5 in", b = "1 in" }]
///     clamp_spring = "1e5 N.m/rad"         # optional
Rig read_rig(const std::string& path);

}  // namespace unrig
