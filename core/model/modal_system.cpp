#include <algorithm>

#include "core/model/system_layout.h"

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Adds what mode i of a rig known as modes does to a sensor that moves by `shape` per unit of the modal displacement. `state`: rows of the state equation, rates of n modes behind their displacements.
void add_modal_sensor(SensorKind reads, double shape, Index channel, Index i, const DualMatrix& state, DualMatrix& output) {
  const Index n = state.rows() / 2;
  switch (reads) {
    case SensorKind::displacement:
    case SensorKind::twist: output.value(channel, i) += shape; return;
    case SensorKind::velocity:
    case SensorKind::twist_rate: output.value(channel, n + i) += shape; return;
    case SensorKind::acceleration: break;
    case SensorKind::load: return;  // of beams
  }
  output.value.row(channel) += shape * state.value.row(n + i);
  for (Index j = 0; j < state.parameters(); ++j) {
    if (!state.depends_on(j) || state.d(j).row(n + i).isZero(0)) continue;
    MatrixXd slope = MatrixXd::Zero(output.rows(), output.cols());
    slope.row(channel) = shape * state.d(j).row(n + i);
    output.add_partial(j, slope);
  }
}

}  // namespace

LinearSystem AeroelasticModel::modal_system(const Conditions& conditions, const VectorXd& theta, const std::vector<std::string>& channels) const {
  Conditions without_pitch = conditions;
  without_pitch.prescribed_pitch = false;
  const auto n = static_cast<Index>(rig_.modal.size());
  const Layout layout = layout_of(n, 0, 0, without_pitch);
  const Index columns = layout.states + layout.inputs, parameters = static_cast<Index>(parameters_.size());
  DualMatrix state(MatrixXd::Zero(layout.states, columns), parameters);
  DualMatrix output(MatrixXd::Zero(static_cast<Index>(channels.size()), columns), parameters);
  state.value.block(0, n, n, n).setIdentity();
  for (Index i = 0; i < n; ++i) {
    const Index first = per_modal_mode * i, row = n + i;
    const double m = theta[first], stiffness = theta[first + 1], damping = theta[first + 2], participation = theta[first + 3];
    const auto set = [&](Index column, double value, Index parameter, double slope) {  // entry value / m, linear in one parameter besides m
      state.value(row, column) = value / m;
      MatrixXd change = MatrixXd::Zero(layout.states, columns);
      change(row, column) = slope / m;
      if (parameter >= 0) state.add_partial(parameter, change);
      change(row, column) = -value / (m * m);
      state.add_partial(first, change);
    };
    set(i, -stiffness, first + 1, -1);
    set(n + i, -damping, first + 2, -1);
    if (layout.force >= 0) set(layout.states + layout.force, 1, -1, 0);
    if (layout.mount >= 0) set(layout.states + layout.mount + 1, -participation, first + 3, -1);
    if (layout.coordinate_port >= 0) set(layout.states + layout.coordinate_port + i, 1, -1, 0);
  }
  for (Index c = 0; c < output.rows(); ++c) {
    const auto sensor = std::find_if(rig_.sensors.begin(), rig_.sensors.end(), [&](const Sensor& s) { return s.column == channels[static_cast<std::size_t>(c)]; });
    for (Index i = 0; i < n; ++i) {
      const ModalMode& mode = rig_.modal[static_cast<std::size_t>(i)];
      if (sensor == rig_.sensors.end()) output.value(c, i) = mode.gauge_gain;
      else add_modal_sensor(sensor->reads, sensor->gain * mode.sensor_shape[static_cast<std::size_t>(sensor - rig_.sensors.begin())], c, i, state, output);
    }
    // Rates and accelerations are against the ground: the mount carries the sensor along. It does not turn.
    if (sensor == rig_.sensors.end() || layout.mount < 0) continue;
    if (sensor->reads == SensorKind::velocity) output.value(c, layout.states + layout.mount) += sensor->gain;
    if (sensor->reads == SensorKind::acceleration) output.value(c, layout.states + layout.mount + 1) += sensor->gain;
  }
  LinearSystem system;
  system.A = state.block(0, 0, layout.states, layout.states);
  system.B = state.block(0, layout.states, layout.states, layout.inputs);
  system.C = output.block(0, 0, output.rows(), layout.states);
  system.D = output.block(0, layout.states, output.rows(), layout.inputs);
  system.coordinates = n;
  system.outputs = channels;
  return system;
}

}  // namespace unrig
