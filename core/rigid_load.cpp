#include "core/rigid_load.h"

#include <algorithm>
#include <numbers>
#include <numeric>
#include <stdexcept>
#include <utility>

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

/// How the state moves with the motion's unknowns at `sample`, from the state after one spline and the running sum of it: states x unknowns.
MatrixXd state_by_motion(const MotionBasis& motion, const MatrixXd& unit, const MatrixXd& summed, Index sample) {
  MatrixXd columns = MatrixXd::Zero(unit.rows(), motion.unknowns());
  for (Index j = 0; j < motion.unknowns(); ++j) {
    const MotionBasis::Column& column = motion.columns()[static_cast<std::size_t>(j)];
    const Index since = sample - column.first;
    if (since <= 0) break;  // columns begin later and later
    for (Index i = 0; i < std::min(since, column.value.size()); ++i) columns.col(j) += column.value[i] * unit.col(since - i);
    if (const Index after = since - column.value.size(); column.tail != 0 && after > 0) columns.col(j) += column.tail * summed.col(after);
  }
  return columns;
}

/// State, and how it moves with the motion's unknowns, at ascending samples. Behind `moving` samples it only decays.
class StateAt {
 public:
  StateAt(const LinearSystem& system, const ExactStep& step, const MotionBasis& motion, const VectorXd& jerk, Index moving)
      : system_(system), motion_(motion), dt_(step.dt), unit_(spline_states(step, moving + 1)), summed_(unit_), at_(moving) {
    for (Index k = 1; k <= moving; ++k) summed_.col(k) += summed_.col(k - 1);
    const Response response = drive(system, step, DualMatrix(MatrixXd::Zero(system.states(), 1)), moving, jerk, {}, Partials::none);
    states_ = response.output;
    state = response.end.value.col(0);
    by_motion = state_by_motion(motion, unit_, summed_, moving);
    state.tail(2).setZero();  // rate and acceleration of a shaft at rest, up to rounding
    by_motion.bottomRows(2).setZero();
    resting_ = {state, by_motion};
  }
  void move_to(Index sample) {
    if (sample < states_.rows()) {
      state = states_.row(sample).transpose();
      by_motion = state_by_motion(motion_, unit_, summed_, sample);
      return;
    }
    const MatrixXd leap = exact_step(system_, dt_ * static_cast<double>(sample - at_)).transition.value;
    at_ = sample;
    resting_ = {leap * resting_.first, leap * resting_.second};
    state = resting_.first;
    by_motion = resting_.second;
  }
  VectorXd state;
  MatrixXd by_motion;

 private:
  const LinearSystem& system_;
  const MotionBasis& motion_;
  double dt_;
  MatrixXd unit_, summed_, states_;
  std::pair<VectorXd, MatrixXd> resting_;
  Index at_;
};

}  // namespace

RigidLoad rigid_load(const AeroelasticModel& model, const Conditions& conditions, const VectorXd& theta, const MotionBasis& motion, double dt,
                     const VectorXd& u, std::vector<Index> slopes_at) {
  const Rig& rig = model.rig();
  if (rig.is_modal()) throw std::invalid_argument("a modal rig has no section to load");
  const double b = rig.semichord(), U = conditions.speed, length = rig.strip_length * static_cast<double>(rig.submerged.size());
  const RowVectorXd downwash = (RowVectorXd(3) << U, (0.5 - rig.axis()) * b, 0).finished();
  LinearSystem lags = lag_system(model.circulation().rate, U, b, downwash);
  const ExactStep step = exact_step(lags, dt);
  const Index n = lags.states(), samples = motion.samples();

  // Rows over the states.
  const double slope = theta[model.index("normal_force_slope")], ca = theta[model.index("apparent_mass_coefficient")];
  const double strength = conditions.density * U * b * length, apparent = std::numbers::pi * conditions.density * b * b * length;
  RowVectorXd built_up = RowVectorXd::Zero(n);
  built_up.tail(3) = downwash;
  MatrixXd missing = MatrixXd::Zero(lags.lags, n);  // y - w of each term
  for (Index k = 0; k < lags.lags; ++k) {
    missing.row(k).tail(3) = -downwash;
    missing(k, k) += 1;
    built_up += model.circulation_amplitude(theta, k) * missing.row(k);
  }
  RowVectorXd inertial = RowVectorXd::Zero(n);
  inertial[n - 1] = -apparent * rig.axis() * b;
  RowVectorXd centrifugal = RowVectorXd::Zero(n);
  centrifugal[n - 2] = apparent * U;
  MatrixXd loads(2, n);
  loads << slope * strength * built_up, slope * strength * built_up + ca * inertial + centrifugal;

  Index moving = 0;
  for (const Interval& active : motion.active()) moving = std::min(samples, active.last);
  const VectorXd jerk = motion_of(motion.coefficients(u), dt).jerk;
  const MatrixXd identity = lags.C.value;
  lags.C = DualMatrix(loads);
  const Response driven = drive(lags, step, DualMatrix(MatrixXd::Zero(n, 1)), moving, jerk, {}, Partials::none);
  const Response resting = coast(lags, step, driven.end, samples - moving, Partials::none);
  RigidLoad load;
  load.circulatory.resize(samples);
  load.circulatory << driven.output.col(0), resting.output.col(0);
  load.normal_force.resize(samples);
  load.normal_force << driven.output.col(1), resting.output.col(1);

  if (slopes_at.empty()) {
    slopes_at.resize(static_cast<std::size_t>(samples));
    std::iota(slopes_at.begin(), slopes_at.end(), Index{0});
  }
  const auto rows = static_cast<Index>(slopes_at.size());
  load.circulatory_by_motion.resize(rows, motion.unknowns());
  load.normal_force_by_motion.resizeLike(load.circulatory_by_motion);
  load.circulatory_by_theta = MatrixXd::Zero(rows, theta.size());
  load.normal_force_by_theta = MatrixXd::Zero(rows, theta.size());
  lags.C = DualMatrix(identity);
  StateAt at(lags, step, motion, jerk, moving);
  for (Index i = 0; i < rows; ++i) {
    at.move_to(slopes_at[static_cast<std::size_t>(i)]);
    load.circulatory_by_motion.row(i).noalias() = loads.row(0) * at.by_motion;
    load.normal_force_by_motion.row(i).noalias() = loads.row(1) * at.by_motion;
    const VectorXd still_missing = missing * at.state;
    for (Index k = 0; k < lags.lags; ++k)
      if (const Index parameter = model.circulation_parameter(k); parameter >= 0) load.circulatory_by_theta(i, parameter) = slope * strength * still_missing[k];
    load.circulatory_by_theta(i, model.index("normal_force_slope")) = strength * built_up.dot(at.state);
    load.normal_force_by_theta.row(i) = load.circulatory_by_theta.row(i);
    load.normal_force_by_theta(i, model.index("apparent_mass_coefficient")) += inertial.dot(at.state);
  }
  return load;
}

}  // namespace unrig
