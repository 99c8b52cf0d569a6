#include "core/model/aeroelastic_model.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include <fmt/format.h>

#include "core/effects/effect.h"
#include "core/law/law_effect.h"
#include "core/model/system_layout.h"
#include "core/run/deviation_slopes.h"

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using std::numbers::pi;

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

/// Errors of numbers, from the parameter `first` on. Slopes of the run's own inputs say nothing of a system with others, such as a force that lets go.
void add_deviations(LinearSystem& system, const DeviationSlopes& slopes, const VectorXd& theta, Index first) {
  const std::vector<SystemSlope>& of = slopes.by_states.at(system.states());
  if (of.empty() || of.front().B.cols() != system.B.cols()) return;
  const auto add = [&](DualMatrix& to, Index row, Index parameter, const MatrixXd& slope) {
    if (slope.isZero(0)) return;
    MatrixXd change = MatrixXd::Zero(to.rows(), to.cols());
    change.middleRows(row, slope.rows()) = slope;
    to.value += theta[parameter] * change;
    to.partial.resize(static_cast<std::size_t>(theta.size()));
    to.add_partial(parameter, change);
  };
  for (std::size_t k = 0; k < of.size(); ++k) {
    const Index parameter = first + static_cast<Index>(k);
    add(system.A, 0, parameter, of[k].A);
    add(system.B, 0, parameter, of[k].B);
    for (std::size_t row = 0; row < slopes.outputs.size(); ++row) {
      const auto output = std::find(system.outputs.begin(), system.outputs.end(), slopes.outputs[row]);
      if (output == system.outputs.end()) continue;
      add(system.C, output - system.outputs.begin(), parameter, of[k].C.row(static_cast<Index>(row)));
      add(system.D, output - system.outputs.begin(), parameter, of[k].D.row(static_cast<Index>(row)));
    }
  }
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
    list_deviations();
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
  list_deviations();
}

void AeroelasticModel::list_deviations() {
  constexpr double beyond_belief = 100;
  first_deviation_ = static_cast<Index>(parameters_.size());
  for (Index k = 0; k < rig_.deviations; ++k) {
    Parameter p{fmt::format("deviation[{}]", k + 1), "1", 0, -beyond_belief, beyond_belief};
    p.known_to = 1;
    parameters_.push_back(std::move(p));
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
  const bool off = rig_.deviations > 0 && conditions.deviations != nullptr, in_all = off && conditions.deviations->whole;
  LinearSystem system = with_effects_at_work(conditions, theta, channels, off && !in_all);
  if (in_all) add_deviations(system, *conditions.deviations, theta, first_deviation_);
  return system;
}

LinearSystem AeroelasticModel::with_effects_at_work(const Conditions& conditions, const VectorXd& theta, const std::vector<std::string>& channels, bool rig_is_off) const {
  const auto gauge = std::find(channels.begin(), channels.end(), "gauge");
  const auto amplify = [&](LinearSystem s) {
    if (gauge != channels.end())
      for (const GaugeFilter& filter : rig_.gauge_filters) append_gauge_filter(s, gauge - channels.begin(), filter);
    return s;
  };
  if (effects_.empty() && !rig_is_off) {
    LinearSystem system = rig_.is_modal() ? modal_system(conditions, theta, channels) : amplify(beam_system(conditions, theta, channels));
    std::vector<Index> recorded{0, 1, 2};
    recorded.resize(static_cast<std::size_t>(system.B.cols()));
    if (!conditions.ports) keep_inputs(system, recorded);
    return system;
  }

  Conditions with_ports = conditions;
  with_ports.force = with_ports.mount = with_ports.ports = true;
  LinearSystem system = rig_.is_modal() ? modal_system(with_ports, theta, channels) : beam_system(with_ports, theta, channels);
  if (rig_is_off) add_deviations(system, *conditions.deviations, theta, first_deviation_);
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
