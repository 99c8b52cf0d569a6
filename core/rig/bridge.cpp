#include "core/rig/bridge.h"

namespace unrig {

using Eigen::Index;
using Eigen::RowVectorXd;

BridgeLevers bridge_levers(const Rig& rig, int element, const CalibrationRow& row) {
  const RowVectorXd beyond = (rig.station.array() - rig.station[element - 1]).max(0.0).matrix().transpose();
  const auto outboard = [element](Index elements) {
    RowVectorXd shape = RowVectorXd::Zero(elements);
    if (element < elements) shape.tail(elements - element).setOnes();
    return shape;
  };
  return {row.per_force * outboard(beyond.size()) + row.per_bending_moment * beyond, row.per_torque * outboard(beyond.size()), row.per_torque * outboard(rig.torsion.inertia.size())};
}

BridgeLevers gauge_levers(const Rig& rig) {
  return bridge_levers(rig, rig.gauge_element, {0, 1 / (rig.station[rig.calibration_element - 1] - rig.station[rig.gauge_element - 1]), 0});
}

double reading_of_unit_load(const Rig& rig, const BridgeLevers& levers) {
  const double quarter_chord = (0.5 + rig.axis()) * rig.semichord();  // ahead of the pitch axis
  double sum = 0;
  for (const int element : rig.submerged) sum += levers.force[element - 1] + quarter_chord * levers.couple[element - 1];
  return sum / static_cast<double>(rig.submerged.size());
}

double reading_of_unit_coefficient(const Rig& rig, const BridgeLevers& levers, double density, double speed) {
  const double span = rig.strip_length * static_cast<double>(rig.submerged.size());
  return density * speed * speed * rig.semichord() * span * reading_of_unit_load(rig, levers);
}

}  // namespace unrig
