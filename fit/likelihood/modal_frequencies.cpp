#include "fit/likelihood/modal_frequencies.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include <fmt/format.h>

namespace unrig {

using Eigen::Index;
using Eigen::VectorXd;

ModalPlace place_of_mode(const AeroelasticModel& model, std::size_t mode) {
  const auto index = [&](const char* what) { return model.index(fmt::format("modal[{}].{}", mode + 1, what)); };
  return {index("mass"), index("stiffness"), index("damping"), index("mount_participation")};
}

double modal_frequency(const AeroelasticModel& model, const VectorXd& theta, std::size_t mode) {
  const ModalPlace p = place_of_mode(model, mode);
  return std::sqrt(std::max(0.0, theta[p.stiffness] / theta[p.mass])) / (2 * std::numbers::pi);
}

double highest_nyquist(const std::vector<RunResidual>& runs) {
  double highest = 0;
  for (const RunResidual& run : runs) highest = std::max(highest, 0.5 / run.run().dt);
  return highest;
}

bool moves_above(const JointProblem& joint, const VectorXd& theta, double nyquist) {
  const AeroelasticModel& model = joint.model();
  const auto held = [&](Index parameter) {
    return std::any_of(joint.unknowns().begin(), joint.unknowns().end(), [&](const Unknown& u) { return u.parameter == parameter && u.held; });
  };
  for (std::size_t i = 0; i < model.rig().modal.size(); ++i)
    if (const ModalPlace p = place_of_mode(model, i); !held(p.stiffness) && modal_frequency(model, theta, i) >= nyquist) return true;
  return false;
}

double stiffest_below(const JointProblem& joint, const Unknown& unknown, double nyquist) {
  constexpr double below = 1 - 1e-9;
  for (std::size_t i = 0; i < joint.model().rig().modal.size(); ++i) {
    const ModalPlace p = place_of_mode(joint.model(), i);
    if (p.stiffness != unknown.parameter) continue;
    for (const Unknown& u : joint.unknowns())
      if (u.parameter == p.mass && u.held) return below * u.value * std::pow(2 * std::numbers::pi * nyquist, 2);
  }
  return std::numeric_limits<double>::infinity();
}

}  // namespace unrig
