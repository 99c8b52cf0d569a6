#pragma once
#include <Eigen/Core>

#include "core/rig/rig.h"

namespace unrig {

/// What a bridge reads of 1 N along the normal force, and of a nose-up couple of 1 N m, at each element. It strains by what acts outboard of it:
///
///   reading = per_force sum F_i + per_bending_moment sum (x_i - x_g) F_i + per_torque sum T_i   over x_i beyond the bridge's element
///
/// Couples act at normal elements, or at those of the torsional chain. The rows are the virtual displacements of which the reading is the work.
struct BridgeLevers {
  Eigen::RowVectorXd force;          ///< per normal element
  Eigen::RowVectorXd couple;         ///< per normal element
  Eigen::RowVectorXd torsion_chain;  ///< per torsional element
};
BridgeLevers bridge_levers(const Rig& rig, int element, const CalibrationRow& row);

/// The gauge reads the bending moment over the lever of its dead weights: per_bending_moment = 1 / (x_c - x_g). The rig has a gauge and a calibration element.
BridgeLevers gauge_levers(const Rig& rig);

/// Of a normal force of 1 N spread evenly over the strips at their quarter chord; 0 where all of them lie inboard of the bridge.
double reading_of_unit_load(const Rig& rig, const BridgeLevers& levers);

/// What a bridge reads of a normal-force coefficient of 1, rho U^2 b L [N] in all (seed, Eq. 2.9).
double reading_of_unit_coefficient(const Rig& rig, const BridgeLevers& levers, double density, double speed);

}  // namespace unrig
