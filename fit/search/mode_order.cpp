#include "fit/search/mode_order.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <vector>

#include <fmt/format.h>

namespace unrig {
namespace {

/// The unknowns of one mode.
struct Mode {
  Unknown *mass, *stiffness, *damping, *participation;
};

std::vector<Mode> modes_of(JointProblem& joint) {
  const auto find = [&](std::size_t mode, const char* what) -> Unknown* {
    const Eigen::Index index = joint.model().index(fmt::format("modal[{}].{}", mode + 1, what));
    return &*std::find_if(joint.unknowns().begin(), joint.unknowns().end(), [&](const Unknown& u) { return u.parameter == index; });
  };
  std::vector<Mode> modes;
  for (std::size_t i = 0; i < joint.model().rig().modal.size(); ++i) modes.push_back({find(i, "mass"), find(i, "stiffness"), find(i, "damping"), find(i, "mount_participation")});
  return modes;
}

/// What mode a reads over what mode b does, per unit of their displacements: of the gauge, of a rig without one of the first sensor.
double reading_ratio(const ModalMode& a, const ModalMode& b) {
  if (a.gauge_gain != 0 || a.sensor_shape.empty()) return a.gauge_gain / b.gauge_gain;
  return a.sensor_shape.front() / b.sensor_shape.front();
}

/// Numbers from 0, by rising `key`.
template <class Key>
std::vector<std::size_t> order_by(std::size_t count, Key key) {
  std::vector<std::size_t> order(count);
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return key(a) < key(b); });
  return order;
}

}  // namespace

bool number_modes_by_frequency(JointProblem& joint) {
  const std::vector<ModalMode>& rig = joint.model().rig().modal;
  if (rig.size() < 2) return false;
  const std::vector<Mode> modes = modes_of(joint);
  const auto wanted = order_by(rig.size(), [&](std::size_t i) { return rig[i].frequency; });
  const auto found = order_by(rig.size(), [&](std::size_t i) { return modes[i].stiffness->value / modes[i].mass->value; });
  if (wanted == found) return false;
  struct Values {
    double mass, stiffness, damping, participation;
  };
  std::vector<Values> next(rig.size());
  for (std::size_t k = 0; k < rig.size(); ++k) {
    const std::size_t a = wanted[k], b = found[k];
    const double gain = reading_ratio(rig[a], rig[b]), scale = modes[a].mass->held ? modes[a].mass->value / modes[b].mass->value : gain;
    if (!(gain > 0) || !std::isfinite(scale)) return false;
    next[a] = {scale * modes[b].mass->value, scale * modes[b].stiffness->value, scale * modes[b].damping->value, scale / gain * modes[b].participation->value};
  }
  for (std::size_t a = 0; a < rig.size(); ++a) {
    const auto set = [&](Unknown& u, double value) {
      const Parameter& p = joint.parameter(u);
      if (!u.held) u.value = std::clamp(value, p.lower, p.upper);
    };
    set(*modes[a].mass, next[a].mass);
    set(*modes[a].stiffness, next[a].stiffness);
    set(*modes[a].damping, next[a].damping);
    set(*modes[a].participation, next[a].participation);
  }
  return true;
}

}  // namespace unrig
