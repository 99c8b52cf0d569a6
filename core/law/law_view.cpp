#include "core/law/law_view.h"

#include "core/effects/effect.h"

namespace unrig {

using Eigen::Index;
using Eigen::RowVectorXd;

RowVectorXd section_twist(const AeroelasticModel& model, Index coordinates) {
  const Basis& basis = model.basis();
  if (basis.torsion_modes < 1) return RowVectorXd::Zero(coordinates);
  return basis.twist(model.rig().submerged.back() - 1, basis.normal_modes) * RowVectorXd::Unit(coordinates, basis.normal_modes);
}

LawView law_view(const AeroelasticModel& model, const LinearSystem& system, const Conditions& conditions, Index strip) {
  LawView view;
  const Rig& rig = model.rig();
  const Basis& basis = model.basis();
  const double U = conditions.speed;
  const auto element = [&] { return rig.submerged[static_cast<std::size_t>(strip)] - 1; };
  view.moves = strip < 0 ? first_mode(model, system.coordinates) : RowVectorXd(basis.normal.row(element()));
  const auto set = [&](Symbol s, double rest, const RowVectorXd& row) {
    view.at_rest[static_cast<std::size_t>(s)] = rest;
    view.row[static_cast<std::size_t>(s)] = row;
  };
  const auto state = [&](Index index) { return RowVectorXd(RowVectorXd::Unit(system.states(), index)); };
  set(Symbol::x, 0, displacement_of(system, view.moves));
  set(Symbol::v, 0, rate_of(system, view.moves));
  set(Symbol::a, 0, rate_of(system, view.moves));
  set(Symbol::U, U, {});
  if (rig.is_modal()) return view;
  const RowVectorXd twist = strip < 0 ? section_twist(model, system.coordinates) : RowVectorXd(basis.twist.row(element()));
  set(Symbol::twist, 0, displacement_of(system, twist));
  set(Symbol::twist_rate, 0, rate_of(system, twist));
  set(Symbol::theta, conditions.onset_angle, system.motion >= 0 ? state(system.motion) : RowVectorXd());
  set(Symbol::theta_rate, 0, system.motion >= 0 ? state(system.motion + 1) : RowVectorXd());
  if (U > 0) set(Symbol::alpha, conditions.onset_angle, angle_of_attack(system, model, U, strip));
  return view;
}

}  // namespace unrig
