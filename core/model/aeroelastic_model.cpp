#include "core/model/aeroelastic_model.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include <fmt/format.h>

#include "core/effects/effect.h"
#include "core/rig/gauge_lever.h"
#include "core/law/law_effect.h"

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::RowVectorXd;
using Eigen::VectorXd;
using std::numbers::pi;

// Parameters of a beam rig, in the order of theta.
enum : Index { normal_stiffness, torsion_stiffness, normal_damping, torsion_damping, apparent_mass, force_slope, beam_parameter_count };
constexpr Index per_modal_mode = 4;  // mass, stiffness, damping, mount participation

/// The modal coordinates extended by the two prescribed ones, heave of the mount and pitch of the shaft: how each moves every element.
struct Kinematics {
  MatrixXd normal;  // elements x (n + 2)
  MatrixXd twist;
  Index n, heave, pitch;
};

Kinematics kinematics(const Basis& basis) {
  const Index elements = basis.normal.rows(), n = basis.size();
  Kinematics k{MatrixXd::Zero(elements, n + 2), MatrixXd::Zero(elements, n + 2), n, n, n + 1};
  k.normal.leftCols(n) = basis.normal;
  k.normal.col(k.heave).setOnes();
  k.twist.leftCols(n) = basis.twist;
  k.twist.col(k.pitch).setOnes();
  return k;
}

MatrixXd weighted(const MatrixXd& left, const VectorXd& weight, const MatrixXd& right) { return left.transpose() * weight.asDiagonal() * right; }

/// Apparent mass pi rho b^2 l of each element [kg], zero out of the water.
VectorXd strip_apparent_mass(const Rig& rig, double density) {
  VectorXd mass = VectorXd::Zero(rig.station.size());
  for (int element : rig.submerged) mass[element - 1] = pi * density * rig.semichord() * rig.semichord() * rig.strip_length;
  return mass;
}

/// Inertia of the structure over the extended coordinates; the mass centre of element i moves by h - r theta.
MatrixXd structural_mass(const Rig& rig, const Basis& basis, const Kinematics& k) {
  const VectorXd moment = rig.normal.inertia.cwiseProduct(rig.mass_centre);
  const MatrixXd coupling = weighted(k.normal, moment, k.twist);
  MatrixXd mass = weighted(k.normal, rig.normal.inertia, k.normal) - coupling - coupling.transpose();
  mass.topLeftCorner(k.n, k.n) += basis.torsion_inertia;
  mass.col(k.pitch).head(k.n) += basis.torsion_pitch_inertia;
  mass.row(k.pitch).head(k.n) += basis.torsion_pitch_inertia.transpose();
  return mass;
}

/// Reaction of the fluid to acceleration for C_a = 1 (Eq. 2.11, 2.13): mass at mid-chord, which moves by h + a b theta, and a couple.
MatrixXd fluid_mass(const Rig& rig, const Kinematics& k, const VectorXd& apparent) {
  const double arm = rig.axis() * rig.semichord(), b = rig.semichord();
  const MatrixXd midchord = k.normal + arm * k.twist;
  return weighted(midchord, apparent, midchord) + b * b / 8 * weighted(k.twist, apparent, k.twist);
}

struct Strips {
  MatrixXd normal, twist;  // strips x (n + 2)
};

Strips strips_of(const Rig& rig, const Kinematics& k) {
  const auto count = static_cast<Index>(rig.submerged.size());
  Strips strips{MatrixXd(count, k.n + 2), MatrixXd(count, k.n + 2)};
  for (Index s = 0; s < count; ++s) {
    strips.normal.row(s) = k.normal.row(rig.submerged[static_cast<std::size_t>(s)] - 1);
    strips.twist.row(s) = k.twist.row(rig.submerged[static_cast<std::size_t>(s)] - 1);
  }
  return strips;
}

/// Column positions of the extended coordinates' displacement, rate and acceleration in the state and the inputs.
/// Prescribed coordinates have theirs in the motion states (pitch) and in the inputs (heave).
struct Layout {
  Index coordinates, lags, motion, states, inputs, force = -1, mount = -1, strip_port = -1, coordinate_port = -1;
};

Layout layout_of(Index coordinates, Index lags, Index strips, const Conditions& conditions) {
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

/// Adds what mode i of a rig known as modes does to a sensor that moves by `shape` per unit of the modal displacement. `state`: rows of the state equation, rates of n modes behind their displacements.
void add_modal_sensor(SensorKind reads, double shape, Index channel, Index i, const DualMatrix& state, DualMatrix& output) {
  const Index n = state.rows() / 2;
  switch (reads) {
    case SensorKind::displacement:
    case SensorKind::twist: output.value(channel, i) += shape; return;
    case SensorKind::velocity:
    case SensorKind::twist_rate: output.value(channel, n + i) += shape; return;
    case SensorKind::acceleration: break;
  }
  output.value.row(channel) += shape * state.value.row(n + i);
  for (Index j = 0; j < state.parameters(); ++j) {
    if (!state.depends_on(j) || state.d(j).row(n + i).isZero(0)) continue;
    MatrixXd slope = MatrixXd::Zero(output.rows(), output.cols());
    slope.row(channel) = shape * state.d(j).row(n + i);
    output.add_partial(j, slope);
  }
}

/// Of the inputs, those in `recorded` with their second derivatives behind them, and what the feedback drives.
void keep_inputs(LinearSystem& system, const std::vector<Index>& recorded) {
  const auto feedbacks = static_cast<Index>(system.feedback.size()), count = static_cast<Index>(recorded.size());
  for (DualMatrix* m : {&system.B, &system.D}) {
    DualMatrix part(MatrixXd::Zero(m->rows(), 2 * count + feedbacks), m->parameters());
    for (Index k = 0; k < count; ++k) part.set_block(0, k, m->block(0, recorded[static_cast<std::size_t>(k)], m->rows(), 1));
    part.set_block(0, 2 * count, m->block(0, m->cols() - feedbacks, m->rows(), feedbacks));
    *m = std::move(part);
  }
  system.curved = count;
  for (Feedback& f : system.feedback)  // states that came later
    for (MatrixXd* m : {&f.sees, &f.sees_rates})
      if (m->rows() > 0) m->conservativeResizeLike(MatrixXd::Zero(m->rows(), system.states()));
}

/// Lets an effect change the system, by no more states than it said before it saw theta: searches carry states from one theta to the next.
void apply(const Effect& e, LinearSystem& system, const EffectContext& context) {
  const Index before = system.states(), promised = e.states ? e.states(context.model, context.conditions) : 0;
  e.apply(system, context);
  const Index added = system.states() - before;
  if (context.gauge < 0 ? added > promised : added != promised)  // what only the gauge reads is left out beside others
    throw std::logic_error(fmt::format("the effect {} adds {} states where it promised {}", e.id, added, promised));
}

}  // namespace

UndampedSystem undamped_system(const Rig& rig, const Basis& basis, double density) {
  const Kinematics k = kinematics(basis);
  VectorXd normal = basis.omega.cwiseAbs2(), torsion = normal;
  normal.tail(basis.torsion_modes).setZero();
  torsion.head(basis.normal_modes).setZero();
  return {structural_mass(rig, basis, k).topLeftCorner(k.n, k.n),
          fluid_mass(rig, k, strip_apparent_mass(rig, density)).topLeftCorner(k.n, k.n), normal.asDiagonal(), torsion.asDiagonal()};
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

AeroelasticModel::AeroelasticModel(Rig rig, Basis basis, IndicialFunction circulation, Circulation build_up)
    : rig_(std::move(rig)), basis_(std::move(basis)), circulation_(std::move(circulation)), build_up_(build_up) {
  // Bounds are what a rig can be, wide: they keep a search physical, they are not prior knowledge.
  if (!rig_.is_modal()) {
    const std::string twist = "Record a run that excites torsion: a rapid step, or a pluck off the pitch axis.";
    parameters_ = {{"normal.stiffness_scale", "1", 1, 1e-3, 1e3, false, {}, Role::stiffness},
                   {"torsion.stiffness_scale", "1", 1, 1e-3, 1e3, false, twist, Role::stiffness, -1, true},
                   {"normal.damping_ratio", "1", 0.01, 0, 0.9, false, {}, Role::damping},
                   {"torsion.damping_ratio", "1", 0.02, 0, 0.9, false, twist, Role::damping, -1, true},
                   {"apparent_mass_coefficient", "1", 1, 0, 10, false, "Record a free decay in the fluid besides one in air.", Role::mass},
                   {"normal_force_slope", "1/rad", 2 * pi, -20, 50, true, "Record a step of the angle at this speed.", Role::slope}};
    for (Index k = 0; build_up_ == Circulation::free && k < circulation_.amplitude.size(); ++k)
      parameters_.push_back({fmt::format("circulation.amplitude[{}]", k + 1), "1", circulation_.amplitude[k], -10, 10, true, "Record a fast step of the angle and the run behind it.", Role::amplitude});
    return;
  }
  for (std::size_t i = 0; i < rig_.modal.size(); ++i) {
    const ModalMode& mode = rig_.modal[i];
    const double omega = 2 * pi * mode.frequency;
    const std::string prefix = fmt::format("modal[{}].", i + 1);
    const int which = static_cast<int>(i);
    parameters_.push_back({prefix + "mass", "kg", mode.mass, 1e-6 * mode.mass, 1e6 * mode.mass, false, {}, Role::mass, which});
    parameters_.push_back({prefix + "stiffness", "N/m", mode.mass * omega * omega, 0, 1e6 * mode.mass * omega * omega, false, {}, Role::stiffness, which});
    parameters_.push_back({prefix + "damping", "N.s/m", 2 * mode.damping_ratio * mode.mass * omega, 0, 1e3 * mode.mass * omega, false, {}, Role::damping, which});
    parameters_.push_back({prefix + "mount_participation", "kg", mode.mass, -1e12 * mode.mass, 1e12 * mode.mass, false, "Record a run with the mount moving.", Role::load, which});
  }
}

VectorXd AeroelasticModel::start_values() const {
  VectorXd theta(static_cast<Index>(parameters_.size()));
  for (Index j = 0; j < theta.size(); ++j) theta[j] = parameters_[static_cast<std::size_t>(j)].start;
  return theta;
}

Index AeroelasticModel::index(const std::string& name) const {
  for (std::size_t j = 0; j < parameters_.size(); ++j)
    if (parameters_[j].name == name) return static_cast<Index>(j);
  throw std::out_of_range(fmt::format("the model of rig '{}' has no parameter '{}'", rig_.name, name));
}

Index AeroelasticModel::circulation_parameter(Index k) const { return build_up_ == Circulation::free ? beam_parameter_count + k : -1; }

double AeroelasticModel::circulation_amplitude(const VectorXd& theta, Index k) const {
  return build_up_ == Circulation::free ? theta[beam_parameter_count + k] : circulation_.amplitude[k];
}

LinearSystem AeroelasticModel::system(const Conditions& conditions, const VectorXd& theta, const std::vector<std::string>& channels) const {
  const auto gauge = std::find(channels.begin(), channels.end(), "gauge");
  const auto amplify = [&](LinearSystem s) {
    if (gauge != channels.end())
      for (const GaugeFilter& filter : rig_.gauge_filters) append_gauge_filter(s, gauge - channels.begin(), filter);
    return s;
  };
  if (effects_.empty()) {
    LinearSystem system = rig_.is_modal() ? modal_system(conditions, theta, channels) : amplify(beam_system(conditions, theta, channels));
    std::vector<Index> recorded{0, 1, 2};
    recorded.resize(static_cast<std::size_t>(system.B.cols()));
    if (!conditions.ports) keep_inputs(system, recorded);
    return system;
  }

  Conditions with_ports = conditions;
  with_ports.force = with_ports.mount = with_ports.ports = true;
  LinearSystem system = rig_.is_modal() ? modal_system(with_ports, theta, channels) : beam_system(with_ports, theta, channels);
  const auto strips = static_cast<Index>(rig_.submerged.size());
  Index first = theta.size();
  for (const std::string& id : effects_) first -= static_cast<Index>(effect(rig_, id).parameters_on(rig_).size());
  for (const std::string& id : effects_) {
    const Effect& e = effect(rig_, id);
    const EffectContext context{*this, conditions, theta, first, gauge == channels.end() ? Index{-1} : gauge - channels.begin(), Ports{0, 1, 3, strips, 3 + strips, system.coordinates}};
    if (e.acts(rig_, conditions)) apply(e, system, context);
    first += static_cast<Index>(e.parameters_on(rig_).size());
  }
  system = amplify(std::move(system));
  std::vector<Index> recorded;
  if (conditions.force) recorded.push_back(0);
  if (conditions.mount) recorded.insert(recorded.end(), {1, 2});
  keep_inputs(system, recorded);
  return system;
}

AeroelasticModel AeroelasticModel::with_effects(const std::vector<std::string>& ids) const {
  AeroelasticModel model = *this;
  for (const std::string& id : ids) {
    const Needs needs = effect(rig_, id).needs;
    if (needs != Needs::any_rig && rig_.is_modal()) throw InputError({rig_.file, 0}, "a rig known only as modes", "wanted a beam rig, which the effect " + id + " needs", "Describe its section and chains, or leave the effect out.");
    if (!has(rig_, needs)) throw InputError({rig_.file, 0}, "no sensor of the twist", "wanted one, which the effect " + id + " needs", "Add a [[sensor]] with reads = \"twist\", or leave the effect out.");
    int place = 0;
    for (Parameter p : effect(rig_, id).parameters_on(rig_)) {
      p.name = id + "." + p.name;
      p.effect = id;
      p.place = place++;
      model.parameters_.push_back(p);
    }
    model.effects_.push_back(id);
  }
  return model;
}

LinearSystem AeroelasticModel::beam_system(const Conditions& conditions, const VectorXd& theta, const std::vector<std::string>& channels) const {
  const double kn = theta[normal_stiffness], kt = theta[torsion_stiffness], zn = theta[normal_damping], zt = theta[torsion_damping];
  const double ca = theta[apparent_mass], slope = theta[force_slope], b = rig_.semichord(), U = conditions.speed;
  const Kinematics k = kinematics(basis_);
  const Strips strips = strips_of(rig_, k);
  const Index n = k.n, strip_count = strips.normal.rows(), parameters = static_cast<Index>(parameters_.size());
  const Index terms = U > 0 ? circulation_.rate.size() : 0;
  const Layout layout = layout_of(n, terms * strip_count, strip_count, conditions);
  const auto rows = [&](Index count) { return Rows(count, layout, parameters); };

  // Mass matrix: structure and apparent mass (never on the force side, where heavy fluid makes it unstable).
  const VectorXd apparent = strip_apparent_mass(rig_, conditions.density);
  const MatrixXd dry = structural_mass(rig_, basis_, k), wet = fluid_mass(rig_, k, apparent);
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
  const MatrixXd normal_n = k.normal.leftCols(n), twist_n = k.twist.leftCols(n);
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
  const MatrixXd three_quarter_chord = normal_n - (0.5 - rig_.axis()) * b * twist_n;  // where the centrifugal force acts
  force.add_rate(U * weighted(three_quarter_chord, apparent, k.twist));
  MatrixXd quarter_chord(strip_count, n);  // where the circulatory force acts
  for (Index s = 0; s < strip_count; ++s) quarter_chord.row(s) = strips.normal.row(s).head(n) + (0.5 + rig_.axis()) * b * strips.twist.row(s).head(n);
  force.dual = force.dual + quarter_chord.transpose() * circulatory.dual;
  force.add_prescribed_acceleration(-inertia.topRows(n));
  force.dual.add_partial(apparent_mass, -force.prescribed_acceleration(wet.topRows(n)));
  if (layout.force >= 0) force.dual.value.col(layout.states + layout.force) += normal_n.row(rig_.loaded_element() - 1).transpose();
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

  // Accelerations of the elements, elastic and prescribed; forces outboard of the gauge.
  const auto element_acceleration = [&](const MatrixXd& per_coordinate) {
    DualMatrix total = MatrixXd(per_coordinate.leftCols(n)) * acceleration;
    total.value += force.prescribed_acceleration(per_coordinate);
    return total;
  };
  DualMatrix outputs(MatrixXd::Zero(static_cast<Index>(channels.size()), layout.states + layout.inputs), parameters);
  for (std::size_t c = 0; c < channels.size(); ++c) {
    const auto row = static_cast<Index>(c);
    if (channels[c] == "gauge") {
      const RowVectorXd arms = gauge_levers(rig_);
      const auto inertial = [&](const VectorXd& m, const MatrixXd& moves) -> MatrixXd { return arms * m.asDiagonal() * moves; };
      const MatrixXd mass_centre = k.normal - MatrixXd(rig_.mass_centre.asDiagonal() * k.twist);
      const MatrixXd midchord = k.normal + rig_.axis() * b * k.twist;
      const DualMatrix fluid = element_acceleration(inertial(apparent, midchord));
      DualMatrix reading = (-1.0) * element_acceleration(inertial(rig_.normal.inertia, mass_centre)) - ca * fluid;
      if (reading.parameters() < parameters) reading.partial.resize(static_cast<std::size_t>(parameters));
      reading.add_partial(apparent_mass, -fluid.value);
      reading.value += U * force.rate(inertial(apparent, k.twist));
      MatrixXd strip_arms(1, strip_count);
      for (Index s = 0; s < strip_count; ++s) strip_arms(0, s) = arms[rig_.submerged[static_cast<std::size_t>(s)] - 1];
      reading = reading + strip_arms * circulatory.dual;
      if (layout.strip_port >= 0) reading.value.middleCols(layout.states + layout.strip_port, strip_count) += strip_arms;
      if (layout.force >= 0) reading.value(0, layout.states + layout.force) += arms[rig_.calibration_element - 1];
      outputs.set_block(row, 0, reading);
      continue;
    }
    for (const Sensor& sensor : rig_.sensors) {
      if (sensor.column != channels[c]) continue;
      const MatrixXd h = sensor.gain * k.normal.row(sensor.element - 1), twist = sensor.gain * k.twist.row(sensor.element - 1);
      switch (sensor.reads) {
        case SensorKind::displacement: outputs.value.row(row) += force.displacement(h); break;
        case SensorKind::velocity: outputs.value.row(row) += force.rate(h); break;
        case SensorKind::acceleration: outputs.set_block(row, 0, element_acceleration(h)); break;
        case SensorKind::twist: outputs.value.row(row) += force.displacement(twist); break;
        case SensorKind::twist_rate: outputs.value.row(row) += force.rate(twist); break;
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

std::vector<std::complex<double>> oscillatory_poles(const LinearSystem& system) {
  const Index size = system.free_states();
  const Eigen::EigenSolver<MatrixXd> eigen(system.A.value.topLeftCorner(size, size), false);
  std::vector<std::complex<double>> poles;
  for (Index i = 0; i < size; ++i)
    // Strips share the rates of their lags: equal real poles may come out as pairs that round-off has split.
    if (eigen.eigenvalues()[i].imag() > 1e-6 * std::abs(eigen.eigenvalues()[i])) poles.push_back(eigen.eigenvalues()[i]);
  std::sort(poles.begin(), poles.end(), [](auto a, auto b) { return std::abs(a) < std::abs(b); });
  return poles;
}

}  // namespace unrig
