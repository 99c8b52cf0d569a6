#include "core/model/rigid_system.h"

#include <numbers>
#include <stdexcept>
#include <utility>

#include "core/propagate/exact_step.h"
#include "core/propagate/response.h"

namespace unrig {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::RowVectorXd;
using Eigen::VectorXd;

LinearSystem rigid_system(const AeroelasticModel& model, const Conditions& conditions, const VectorXd& theta) {
  const Rig& rig = model.rig();
  if (rig.is_modal()) throw std::invalid_argument("a rig that is known only as modes has no section to load");
  const double U = conditions.speed, rho = conditions.density, b = rig.semichord(), a = rig.axis();
  const double span = rig.strip_length * static_cast<double>(rig.submerged.size()), apparent = std::numbers::pi * rho * b * b * span;
  const Index of_slope = model.index("normal_force_slope"), of_apparent_mass = model.index("apparent_mass_coefficient");
  const Index terms = U > 0 ? model.circulation().rate.size() : 0, motion = terms, states = terms + 3;

  RowVectorXd downwash = RowVectorXd::Zero(states);
  downwash[motion] = U;
  downwash[motion + 1] = (0.5 - a) * b;

  MatrixXd state = MatrixXd::Zero(states, states);
  DualMatrix output(MatrixXd::Zero(3, states), theta.size());
  if (U > 0) {
    const VectorXd rate = model.circulation().rate * (U / b);
    state.topRows(terms) = rate * downwash;  // y' = rate (w - y)
    state.diagonal().head(terms) -= rate;
    const auto loads = [&](const RowVectorXd& circulatory) -> MatrixXd { return Eigen::Vector3d(1, 1, (0.5 + a) * b) * circulatory; };
    const double strength = rho * U * b * span;
    RowVectorXd built_up = downwash;
    for (Index k = 0; k < terms; ++k) {
      RowVectorXd missing = -downwash;  // y - w
      missing[k] += 1;
      built_up += model.circulation_amplitude(theta, k) * missing;
      if (const Index amplitude = model.circulation_parameter(k); amplitude >= 0) output.add_partial(amplitude, loads(theta[of_slope] * strength * missing));
    }
    output.value = loads(theta[of_slope] * strength * built_up);
    output.add_partial(of_slope, loads(strength * built_up));
  }
  state(motion, motion + 1) = state(motion + 1, motion + 2) = 1;

  output.value(1, motion + 1) += apparent * U;
  output.value(2, motion + 1) -= (0.5 - a) * b * apparent * U;
  MatrixXd inertial = MatrixXd::Zero(3, states);
  inertial(1, motion + 2) = -apparent * a * b;
  inertial(2, motion + 2) = -apparent * b * b * (1.0 / 8 + a * a);
  output.value += theta[of_apparent_mass] * inertial;
  output.add_partial(of_apparent_mass, inertial);

  LinearSystem system;
  system.A = DualMatrix(state);
  system.B = DualMatrix(MatrixXd::Zero(states, 0));
  system.C = std::move(output);
  system.D = DualMatrix(MatrixXd::Zero(3, 0));
  system.lags = terms;
  system.motion = motion;
  system.outputs = {"circulatory", "normal_force", "moment"};
  return system;
}

MatrixXd motion_response(const LinearSystem& system, const Motion& motion, double dt) {
  VectorXd start = VectorXd::Zero(system.states());
  start.segment(system.motion, 3) << motion.angle[0], motion.rate[0], motion.acceleration[0];
  return drive(system, exact_step(system, dt), DualMatrix(start), motion.jerk.size(), motion.jerk, {}, Partials::none).output;
}

}  // namespace unrig
