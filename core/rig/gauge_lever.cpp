#include "core/rig/gauge_lever.h"

namespace unrig {

Eigen::RowVectorXd gauge_levers(const Rig& rig) {
  const double gauge = rig.station[rig.gauge_element - 1];
  return ((rig.station.array() - gauge).max(0.0) / (rig.station[rig.calibration_element - 1] - gauge)).matrix().transpose();
}

double gauge_reading_of_unit_load(const Rig& rig) {
  const Eigen::RowVectorXd levers = gauge_levers(rig);
  double sum = 0;
  for (const int element : rig.submerged) sum += levers[element - 1];
  return sum / static_cast<double>(rig.submerged.size());
}

double gauge_reading_of_unit_coefficient(const Rig& rig, double density, double speed) {
  const double span = rig.strip_length * static_cast<double>(rig.submerged.size());
  return density * speed * speed * rig.semichord() * span * gauge_reading_of_unit_load(rig);
}

}  // namespace unrig
