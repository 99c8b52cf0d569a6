#pragma once
#include <Eigen/Core>

#include "core/rig/rig.h"

namespace unrig {

/// What the gauge reads of a normal force of 1 N at each normal element: its lever about the gauge's station over the lever of the calibration station,
/// max(0, x_i - x_g) / (x_c - x_g), a row over the elements. The rig has a gauge and a calibration element.
Eigen::RowVectorXd gauge_levers(const Rig& rig);

/// The same of 1 N that is spread evenly over the strips; 0 where all of them lie inboard of the gauge.
double gauge_reading_of_unit_load(const Rig& rig);

/// What the gauge reads of a normal-force coefficient of 1, rho U^2 b L [N] in all (seed, Eq. 2.9).
double gauge_reading_of_unit_coefficient(const Rig& rig, double density, double speed);

}  // namespace unrig
