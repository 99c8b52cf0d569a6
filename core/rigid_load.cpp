#include "core/rigid_load.h"

#include <numbers>
#include <stdexcept>

#include "core/exact_step.h"
#include "core/response.h"

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::RowVectorXd;
using Eigen::VectorXd;

/// Lags y' = (beta U / b) (w - y) of one strip, driven by p, p', p''.
LinearSystem lag_system(const VectorXd& rate, double U, double b, const RowVectorXd& downwash) {
  const Index terms = U > 0 ? rate.size() : 0, n = terms + 3;
  LinearSystem s;
  s.A = DualMatrix(MatrixXd::Zero(n, n));
  for (Index k = 0; k < terms; ++k) {
    s.A.value.row(k).tail(3) = rate[k] * U / b * downwash;
    s.A.value(k, k) = -rate[k] * U / b;
  }
  s.A.value(terms, terms + 1) = s.A.value(terms + 1, terms + 2) = 1;
  s.B = DualMatrix(MatrixXd(n, 0));
  s.C = DualMatrix(MatrixXd::Identity(n, n));
  s.D = DualMatrix(MatrixXd(n, 0));
  s.lags = terms;
  s.motion = terms;
  return s;
}

/// Response columns of the motion unknowns, from the response to one spline and to splines at every sample.
MatrixXd by_motion(const MotionBasis& motion, const RowVectorXd& unit) {
  RowVectorXd summed = unit;
  for (Index k = 1; k < summed.size(); ++k) summed[k] += summed[k - 1];
  const Index samples = motion.samples();
  MatrixXd columns = MatrixXd::Zero(samples, motion.unknowns());
  for (Index j = 0; j < motion.unknowns(); ++j) {
    const MotionBasis::Column& column = motion.columns()[static_cast<std::size_t>(j)];
    for (Index i = 0; i < column.value.size(); ++i) {
      const Index knot = column.first + i;
      if (knot < samples) columns.col(j).tail(samples - knot) += column.value[i] * unit.head(samples - knot).transpose();
    }
    const Index knot = column.first + column.value.size();
    if (column.tail != 0 && knot < samples) columns.col(j).tail(samples - knot) += column.tail * summed.head(samples - knot).transpose();
  }
  return columns;
}

}  // namespace

RigidLoad rigid_load(const AeroelasticModel& model, const Conditions& conditions, const VectorXd& theta, const MotionBasis& motion, double dt,
                     const VectorXd& u) {
  const Rig& rig = model.rig();
  if (rig.is_modal()) throw std::invalid_argument("a modal rig has no section to load");
  const double b = rig.semichord(), U = conditions.speed, length = rig.strip_length * static_cast<double>(rig.submerged.size());
  const RowVectorXd downwash = (RowVectorXd(3) << U, (0.5 - rig.axis()) * b, 0).finished();
  const LinearSystem lags = lag_system(model.circulation().rate, U, b, downwash);
  const ExactStep step = exact_step(lags, dt);
  const Index n = lags.states(), samples = motion.samples();

  const VectorXd coefficients = motion.coefficients(u);
  const MatrixXd states = drive(lags, step, DualMatrix(MatrixXd::Zero(n, 1)), samples, motion_of(coefficients, dt).jerk, {}, Partials::none).output;

  // Rows over the states, and how theta moves them.
  const double slope = theta[model.index("normal_force_slope")], ca = theta[model.index("apparent_mass_coefficient")];
  const double strength = conditions.density * U * b * length, apparent = std::numbers::pi * conditions.density * b * b * length;
  RowVectorXd built_up = RowVectorXd::Zero(n);
  built_up.tail(3) = downwash;
  RigidLoad load;
  load.circulatory_by_theta = MatrixXd::Zero(samples, theta.size());
  for (Index k = 0; k < lags.lags; ++k) {
    RowVectorXd missing = RowVectorXd::Zero(n);
    missing.tail(3) = -downwash;
    missing[k] += 1;
    const double amplitude = model.circulation_amplitude(theta, k);
    built_up += amplitude * missing;
    if (const Index parameter = model.circulation_parameter(k); parameter >= 0)
      load.circulatory_by_theta.col(parameter) = slope * strength * (states * missing.transpose());
  }
  RowVectorXd inertial = RowVectorXd::Zero(n);
  inertial[n - 1] = -apparent * rig.axis() * b;
  RowVectorXd centrifugal = RowVectorXd::Zero(n);
  centrifugal[n - 2] = apparent * U;

  const RowVectorXd circulatory = slope * strength * built_up, whole = circulatory + ca * inertial + centrifugal;
  load.circulatory = states * circulatory.transpose();
  load.normal_force = states * whole.transpose();
  load.circulatory_by_theta.col(model.index("normal_force_slope")) = strength * (states * built_up.transpose());
  load.normal_force_by_theta = load.circulatory_by_theta;
  load.normal_force_by_theta.col(model.index("apparent_mass_coefficient")) += states * inertial.transpose();
  const MatrixXd unit = spline_states(step, samples);
  load.circulatory_by_motion = by_motion(motion, circulatory * unit);
  load.normal_force_by_motion = by_motion(motion, whole * unit);
  return load;
}

}  // namespace unrig
