#include "core/rigid_system.h"

#include <numbers>
#include <stdexcept>

#include "core/exact_step.h"
#include "core/response.h"

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
  const double ca = theta[model.index("apparent_mass_coefficient")], slope = theta[model.index("normal_force_slope")];
  const Index terms = U > 0 ? model.circulation().rate.size() : 0, motion = terms, states = terms + 3;

  RowVectorXd downwash = RowVectorXd::Zero(states);
  downwash[motion] = U;
  downwash[motion + 1] = (0.5 - a) * b;

  MatrixXd state = MatrixXd::Zero(states, states);
  RowVectorXd circulatory = RowVectorXd::Zero(states);
  if (U > 0) {
    const VectorXd rate = model.circulation().rate * (U / b);
    state.topRows(terms) = rate * downwash;  // y' = rate (w - y)
    state.diagonal().head(terms) -= rate;
    circulatory = downwash;
    for (Index k = 0; k < terms; ++k) {
      const double amplitude = model.circulation_amplitude(theta, k);
      circulatory -= amplitude * downwash;
      circulatory[k] += amplitude;
    }
    circulatory *= slope * rho * U * b * span;
  }
  state(motion, motion + 1) = state(motion + 1, motion + 2) = 1;

  MatrixXd output(3, states);
  output.row(0) = circulatory;
  output.row(1) = circulatory;
  output(1, motion + 1) += apparent * U;
  output(1, motion + 2) -= ca * apparent * a * b;
  output.row(2) = (0.5 + a) * b * circulatory;
  output(2, motion + 1) -= (0.5 - a) * b * apparent * U;
  output(2, motion + 2) -= ca * apparent * b * b * (1.0 / 8 + a * a);

  LinearSystem system;
  system.A = DualMatrix(state);
  system.B = DualMatrix(MatrixXd::Zero(states, 0));
  system.C = DualMatrix(output);
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
