#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/model/system_layout.h"
#include "core/rig/bridge.h"

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using std::numbers::pi;

/// How elements are displaced, a column for each displacement: modal coordinates and the two prescribed ones, heave of the mount and pitch of the shaft; or virtual, of which a bridge reads the work.
struct Displacements {
  MatrixXd normal, twist;  // normal elements x displacements
  MatrixXd torsion_chain;  // torsional elements x displacements
};

Displacements displacements_of(const Basis& basis) {
  const Index n = basis.size();
  const auto with_prescribed = [n](const MatrixXd& shapes, double heave, double pitch) {
    MatrixXd all(shapes.rows(), n + 2);
    all << shapes, Eigen::VectorXd::Constant(shapes.rows(), heave), Eigen::VectorXd::Constant(shapes.rows(), pitch);
    return all;
  };
  return {with_prescribed(basis.normal, 1, 0), with_prescribed(basis.twist, 0, 1), with_prescribed(basis.torsion_chain, 0, 1)};
}

/// That of which a bridge reads the work.
Displacements displacements_of(const BridgeLevers& levers) { return {levers.force.transpose(), levers.couple.transpose(), levers.torsion_chain.transpose()}; }

MatrixXd weighted(const MatrixXd& left, const VectorXd& weight, const MatrixXd& right) { return left.transpose() * weight.asDiagonal() * right; }

/// Apparent mass pi rho b^2 l of each element [kg], zero out of the water.
VectorXd strip_apparent_mass(const Rig& rig, double density) {
  VectorXd mass = VectorXd::Zero(rig.station.size());
  for (int element : rig.submerged) mass[element - 1] = pi * density * rig.semichord() * rig.semichord() * rig.strip_length;
  return mass;
}

/// Work on the displacements `left` of the structure's inertia under unit accelerations of `right`, reversed; the mass centre of element i moves by h - r theta.
MatrixXd structural_mass(const Rig& rig, const Displacements& left, const Displacements& right) {
  const VectorXd moment = rig.normal.inertia.cwiseProduct(rig.mass_centre);
  return weighted(left.normal, rig.normal.inertia, right.normal) - weighted(left.normal, moment, right.twist) - weighted(left.twist, moment, right.normal) +
         weighted(left.torsion_chain, rig.torsion.inertia, right.torsion_chain);
}

/// Of the fluid's for C_a = 1 (Eq. 2.11, 2.13): mass at mid-chord, which moves by h + a b theta, and a couple.
MatrixXd fluid_mass(const Rig& rig, const VectorXd& apparent, const Displacements& left, const Displacements& right) {
  const double arm = rig.axis() * rig.semichord(), b = rig.semichord();
  return weighted(left.normal + arm * left.twist, apparent, right.normal + arm * right.twist) + b * b / 8 * weighted(left.twist, apparent, right.twist);
}

/// What the centrifugal force, which acts at three-quarter chord, does on `left` per rate of `right` and unit speed.
MatrixXd centrifugal(const Rig& rig, const VectorXd& apparent, const Displacements& left, const Displacements& right) {
  return weighted(left.normal - (0.5 - rig.axis()) * rig.semichord() * left.twist, apparent, right.twist);
}

/// The strips' own rows.
struct Strips {
  MatrixXd normal, twist;  // strips x displacements
};

Strips strips_of(const Rig& rig, const Displacements& moved) {
  const auto count = static_cast<Index>(rig.submerged.size());
  Strips strips{MatrixXd(count, moved.normal.cols()), MatrixXd(count, moved.normal.cols())};
  for (Index s = 0; s < count; ++s) {
    strips.normal.row(s) = moved.normal.row(rig.submerged[static_cast<std::size_t>(s)] - 1);
    strips.twist.row(s) = moved.twist.row(rig.submerged[static_cast<std::size_t>(s)] - 1);
  }
  return strips;
}

/// How the strips' quarter chord moves, where the circulatory force acts.
MatrixXd quarter_chord(const Rig& rig, const Strips& strips) { return strips.normal + (0.5 + rig.axis()) * rig.semichord() * strips.twist; }

/// A quantity linear in states and inputs: rows x (states + inputs), with partials.
class Rows {
 public:
  Rows(Index rows, const Layout& layout, Index parameters)
      : layout_(layout), dual(MatrixXd::Zero(rows, layout.states + layout.inputs), parameters) {}

  // `per_coordinate`: rows x (n + 2) over the extended coordinates.
  void add_displacement(const MatrixXd& per_coordinate) { dual.value += displacement(per_coordinate); }
  void add_rate(const MatrixXd& per_coordinate) { dual.value += rate(per_coordinate); }
  void add_prescribed_acceleration(const MatrixXd& per_coordinate) { dual.value += prescribed_acceleration(per_coordinate); }

  MatrixXd displacement(const MatrixXd& c) const { return spread(c, 0, 0, -1); }
  MatrixXd rate(const MatrixXd& c) const { return spread(c, layout_.coordinates, 1, 0); }
  MatrixXd prescribed_acceleration(const MatrixXd& c) const { return spread(c, -1, 2, 1); }

 private:
  MatrixXd spread(const MatrixXd& c, Index first, Index pitch_order, Index heave_order) const {
    MatrixXd full = MatrixXd::Zero(c.rows(), dual.cols());
    const Index n = layout_.coordinates;
    if (first >= 0) full.middleCols(first, n) = c.leftCols(n);
    if (layout_.mount >= 0 && heave_order >= 0) full.col(layout_.states + layout_.mount + heave_order) += c.col(n);
    if (layout_.motion >= 0) full.col(layout_.motion + pitch_order) += c.col(n + 1);
    return full;
  }
  const Layout& layout_;

 public:
  DualMatrix dual;
};

}  // namespace

UndampedSystem undamped_system(const Rig& rig, const Basis& basis, double density) {
  const Displacements moved = displacements_of(basis);
  const Index n = basis.size();
  VectorXd normal = basis.omega.cwiseAbs2(), torsion = normal;
  normal.tail(basis.torsion_modes).setZero();
  torsion.head(basis.normal_modes).setZero();
  return {structural_mass(rig, moved, moved).topLeftCorner(n, n), fluid_mass(rig, strip_apparent_mass(rig, density), moved, moved).topLeftCorner(n, n), normal.asDiagonal(),
          torsion.asDiagonal()};
}

Eigen::VectorXd coupled_frequencies(const Rig& rig, const Basis& basis, double density, double apparent_mass_coefficient) {
  const UndampedSystem s = undamped_system(rig, basis, density);
  const Eigen::GeneralizedSelfAdjointEigenSolver<MatrixXd> eigen(s.normal_stiffness + s.torsion_stiffness,
                                                                 s.mass + apparent_mass_coefficient * s.fluid_mass, Eigen::EigenvaluesOnly);
  return eigen.eigenvalues().cwiseSqrt() / (2 * pi);
}

double lowest_frequency(const Rig& rig, double density) {
  if (!rig.is_modal()) return coupled_frequencies(rig, make_basis(rig, Index{1}, Index{1}), density)[0];
  double lowest = rig.modal.front().frequency;
  for (const ModalMode& mode : rig.modal) lowest = std::min(lowest, mode.frequency);
  return lowest;
}

LinearSystem AeroelasticModel::beam_system(const Conditions& conditions, const VectorXd& theta, const std::vector<std::string>& channels) const {
  const double kn = theta[normal_stiffness], kt = theta[torsion_stiffness], zn = theta[normal_damping], zt = theta[torsion_damping];
  const double ca = theta[apparent_mass], slope = theta[force_slope], b = rig_.semichord(), U = conditions.speed;
  const Displacements moved = displacements_of(basis_);
  const Strips strips = strips_of(rig_, moved);
  const Index n = basis_.size(), strip_count = strips.normal.rows(), parameters = static_cast<Index>(parameters_.size());
  const Index terms = U > 0 ? circulation_.rate.size() : 0;
  const Layout layout = layout_of(n, terms * strip_count, strip_count, conditions);
  const auto rows = [&](Index count) { return Rows(count, layout, parameters); };

  // Mass matrix: structure and apparent mass (never on the force side, where heavy fluid makes it unstable).
  const VectorXd apparent = strip_apparent_mass(rig_, conditions.density);
  const MatrixXd dry = structural_mass(rig_, moved, moved), wet = fluid_mass(rig_, apparent, moved, moved);
  const MatrixXd inertia = dry + ca * wet;
  DualMatrix mass(inertia.topLeftCorner(n, n), parameters);
  mass.add_partial(apparent_mass, wet.topLeftCorner(n, n));

  // Circulatory force of each strip (Eq. 2.9): half of it at once, the rest through the lags y' = (beta U / b) (w - y).
  Rows downwash = rows(strip_count);
  downwash.add_displacement(U * strips.twist);
  downwash.add_rate((0.5 - rig_.axis()) * b * strips.twist - strips.normal);
  Rows circulatory = rows(strip_count);
  if (U > 0) {
    const double strength = conditions.density * U * b * rig_.strip_length;
    MatrixXd built_up = downwash.dual.value;
    for (Index term = 0; term < terms; ++term) {  // amplitude (y - w): what is still missing of w
      MatrixXd missing = -downwash.dual.value;
      missing.middleCols(2 * n + term * strip_count, strip_count).diagonal().array() += 1;
      built_up += circulation_amplitude(theta, term) * missing;
      if (const Index parameter = circulation_parameter(term); parameter >= 0) circulatory.dual.add_partial(parameter, slope * strength * missing);
    }
    circulatory.dual.value = slope * strength * built_up;
    circulatory.dual.add_partial(force_slope, strength * built_up);
  }

  // Generalised forces on the modal coordinates (Eq. 3.9, 3.16).
  Rows force = rows(n);
  VectorXd stiffness(n), damping(n);
  const VectorXd& omega = basis_.omega;
  for (Index i = 0; i < n; ++i) {
    const bool is_normal = i < basis_.normal_modes;
    const double scale = is_normal ? kn : kt, zeta = is_normal ? zn : zt, root = std::sqrt(scale);
    stiffness[i] = scale * omega[i] * omega[i];
    damping[i] = 2 * zeta * root * omega[i];
    MatrixXd unit = MatrixXd::Zero(n, n + 2);
    unit(i, i) = 1;
    force.dual.add_partial(is_normal ? normal_stiffness : torsion_stiffness,
                           -omega[i] * omega[i] * force.displacement(unit) - zeta / root * omega[i] * force.rate(unit));
    force.dual.add_partial(is_normal ? normal_damping : torsion_damping, -2 * root * omega[i] * force.rate(unit));
  }
  MatrixXd spring = MatrixXd::Zero(n, n + 2), dashpot = MatrixXd::Zero(n, n + 2);
  spring.leftCols(n) = stiffness.asDiagonal();
  dashpot.leftCols(n) = damping.asDiagonal();
  force.add_displacement(-spring);
  force.add_rate(-dashpot);
  force.add_rate(U * centrifugal(rig_, apparent, moved, moved).topRows(n));
  force.dual = force.dual + quarter_chord(rig_, strips).leftCols(n).transpose() * circulatory.dual;
  force.add_prescribed_acceleration(-inertia.topRows(n));
  force.dual.add_partial(apparent_mass, -force.prescribed_acceleration(wet.topRows(n)));
  if (layout.force >= 0) force.dual.value.col(layout.states + layout.force) += moved.normal.row(rig_.loaded_element() - 1).head(n).transpose();
  if (layout.strip_port >= 0) force.dual.value.middleCols(layout.states + layout.strip_port, strip_count) += strips.normal.leftCols(n).transpose();
  if (layout.coordinate_port >= 0) force.dual.value.middleCols(layout.states + layout.coordinate_port, n) += MatrixXd::Identity(n, n);
  const DualMatrix acceleration = solve(mass, force.dual);

  // State equation.
  LinearSystem system;
  DualMatrix state(MatrixXd::Zero(layout.states, layout.states + layout.inputs), parameters);
  state.value.block(0, n, n, n).setIdentity();
  state.set_block(n, 0, acceleration);
  for (Index term = 0; term < terms; ++term) {
    const double rate = circulation_.rate[term] * U / b;
    const Index first = 2 * n + term * strip_count;
    state.value.middleRows(first, strip_count) = rate * downwash.dual.value;
    state.value.block(first, first, strip_count, strip_count).diagonal().array() -= rate;
  }
  if (layout.motion >= 0) state.value(layout.motion, layout.motion + 1) = state.value(layout.motion + 1, layout.motion + 2) = 1;

  const auto element_acceleration = [&](const MatrixXd& per_coordinate) {  // elastic and prescribed
    DualMatrix total = MatrixXd(per_coordinate.leftCols(n)) * acceleration;
    total.value += force.prescribed_acceleration(per_coordinate);
    return total;
  };
  const auto read_by_bridge = [&](const BridgeLevers& levers) {  // all forces outboard, inertial ones included
    const Displacements work = displacements_of(levers);
    const Strips on_strips = strips_of(rig_, work);
    const DualMatrix fluid = element_acceleration(fluid_mass(rig_, apparent, work, moved));
    DualMatrix reading = (-1.0) * element_acceleration(structural_mass(rig_, work, moved)) - ca * fluid;
    if (reading.parameters() < parameters) reading.partial.resize(static_cast<std::size_t>(parameters));
    reading.add_partial(apparent_mass, -fluid.value);
    reading.value += U * force.rate(centrifugal(rig_, apparent, work, moved));
    reading = reading + MatrixXd(quarter_chord(rig_, on_strips).transpose()) * circulatory.dual;
    if (layout.strip_port >= 0) reading.value.middleCols(layout.states + layout.strip_port, strip_count) += on_strips.normal.transpose();
    if (layout.force >= 0) reading.value(0, layout.states + layout.force) += levers.force[rig_.loaded_element() - 1];
    return reading;
  };
  DualMatrix outputs(MatrixXd::Zero(static_cast<Index>(channels.size()), layout.states + layout.inputs), parameters);
  for (std::size_t c = 0; c < channels.size(); ++c) {
    const auto row = static_cast<Index>(c);
    if (channels[c] == "gauge") {
      outputs.set_block(row, 0, read_by_bridge(gauge_levers(rig_)));
      continue;
    }
    for (const Sensor& sensor : rig_.sensors) {
      if (sensor.column != channels[c]) continue;
      const auto of_element = [&](const MatrixXd& moves) -> MatrixXd { return sensor.gain * moves.row(sensor.element - 1); };
      switch (sensor.reads) {
        case SensorKind::displacement: outputs.value.row(row) += force.displacement(of_element(moved.normal)); break;
        case SensorKind::velocity: outputs.value.row(row) += force.rate(of_element(moved.normal)); break;
        case SensorKind::acceleration: outputs.set_block(row, 0, element_acceleration(of_element(moved.normal))); break;
        case SensorKind::twist: outputs.value.row(row) += force.displacement(of_element(moved.twist)); break;
        case SensorKind::twist_rate: outputs.value.row(row) += force.rate(of_element(moved.twist)); break;
        case SensorKind::load: outputs.set_block(row, 0, read_by_bridge(bridge_levers(rig_, sensor.element, sensor.row))); break;
      }
      break;
    }
  }

  system.A = state.block(0, 0, layout.states, layout.states);
  system.B = state.block(0, layout.states, layout.states, layout.inputs);
  system.C = outputs.block(0, 0, outputs.rows(), layout.states);
  system.D = outputs.block(0, layout.states, outputs.rows(), layout.inputs);
  system.coordinates = n;
  system.lags = layout.lags;
  system.motion = layout.motion;
  system.outputs = channels;
  return system;
}

}  // namespace unrig
