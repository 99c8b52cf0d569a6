#include "core/rigid_load.h"

#include <algorithm>
#include <numbers>
#include <numeric>
#include <stdexcept>
#include <tuple>
#include <utility>
#include <vector>

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

/// State of the lags and the motion over the record, and how it moves with the motion's unknowns.
class Lags {
 public:
  Lags(const LinearSystem& system, const ExactStep& step, const MotionBasis& motion, const VectorXd& unknowns, const RigidLoad::State& from)
      : system_(system),
        step_(step),
        motion_(motion),
        moves_(motion_of(motion.coefficients(unknowns), step.dt)),
        phases_(motion.phases()),
        from_(from.value.size() > 0 ? from.value : VectorXd::Zero(system.states())),
        from_by_theta_(from.by_theta.size() > 0 ? from.by_theta : MatrixXd(system.states(), 0)) {
    moves_.angle.array() += from_[system.motion];
    Index longest = 0;
    for (const MotionBasis::Phase& phase : phases_)
      if (phase.moving) longest = std::max(longest, phase.samples.length());
    unit_ = spline_states(step, longest + 1);
    summed_ = unit_;
    for (Index k = 1; k < summed_.cols(); ++k) summed_.col(k) += summed_.col(k - 1);
  }

  /// Quantities that are `rows` times the state, at every sample.
  MatrixXd follow(const MatrixXd& rows) const {
    LinearSystem system = system_;
    system.C = DualMatrix(rows);
    const FreeResponse free(system, step_, Partials::none);
    MatrixXd all(motion_.samples(), rows.rows());
    DualMatrix state{MatrixXd(from_)};
    for (const MotionBasis::Phase& phase : phases_) {
      const Interval& s = phase.samples;
      const Response response = phase.moving ? drive(system, step_, state, s.length(), moves_.jerk.segment(s.first, s.length()), {}, Partials::none) : free.from(state, s.length());
      state = response.end;
      if (phase.moving && s.last < motion_.samples()) stand_still(state.value, system_.motion, moves_.angle.segment(s.last, 1));
      all.middleRows(s.first, s.length()) = response.output;
    }
    return all;
  }

  /// Hands `take` the state and its slope, states x (unknowns, then theta by way of where it began), at these ascending samples, with the place of each among them. Returns both behind the last sample.
  template <class Take>
  std::pair<VectorXd, MatrixXd> at(const std::vector<Index>& samples, Take take) const {
    const Index n = system_.states();
    VectorXd state = from_;
    MatrixXd slope = MatrixXd::Zero(n, motion_.unknowns() + from_by_theta_.cols());
    slope.rightCols(from_by_theta_.cols()) = from_by_theta_;
    std::size_t next = 0;
    for (const MotionBasis::Phase& phase : phases_) {
      const Interval& s = phase.samples;
      MatrixXd states;  // samples x n
      if (phase.moving) {
        LinearSystem whole = system_;
        whole.C = DualMatrix(MatrixXd::Identity(n, n));
        states = drive(whole, step_, DualMatrix(MatrixXd(state)), s.length() + 1, with_one_more(moves_.jerk, s), {}, Partials::none).output;
      }
      const auto behind = [&](Index sample) -> std::pair<VectorXd, MatrixXd> {
        const MatrixXd leap = exact_step(system_, step_.dt * static_cast<double>(sample - s.first)).transition.value;
        if (!phase.moving) return {leap * state, leap * slope};
        MatrixXd its_slope = leap * slope;
        its_slope.leftCols(motion_.unknowns()) += own_splines(s, sample);
        return {states.row(sample - s.first).transpose(), std::move(its_slope)};
      };
      for (; next < samples.size() && samples[next] < s.last; ++next) {
        const auto [there, its_slope] = behind(samples[next]);
        take(static_cast<Index>(next), there, its_slope);
      }
      std::tie(state, slope) = behind(s.last);
      if (!phase.moving || s.last >= motion_.samples()) continue;
      MatrixXd column = state;
      stand_still(column, system_.motion, moves_.angle.segment(s.last, 1));
      state = column.col(0);
      RowVectorXd angle(slope.cols());
      angle << motion_.angle_columns({s.last, s.last + 1}), from_by_theta_.row(system_.motion);
      stand_still(slope, system_.motion, angle);
    }
    return {state, slope};
  }

 private:
  /// The jerk over these samples and, where the record goes on, the next.
  static VectorXd with_one_more(const VectorXd& jerk, const Interval& s) {
    VectorXd longer = VectorXd::Zero(s.length() + 1);
    longer.head(s.length()) = jerk.segment(s.first, s.length());
    return longer;
  }

  /// d state / d unknowns at `sample`, of the splines that begin in the interval.
  MatrixXd own_splines(const Interval& interval, Index sample) const {
    MatrixXd columns = MatrixXd::Zero(unit_.rows(), motion_.unknowns());
    for (Index j = 0; j < motion_.unknowns(); ++j) {
      const MotionBasis::Column& column = motion_.columns()[static_cast<std::size_t>(j)];
      if (column.first < interval.first) continue;
      const Index since = sample - column.first;
      if (since <= 0) break;  // columns begin later and later
      for (Index i = 0; i < std::min(since, column.value.size()); ++i) columns.col(j) += column.value[i] * unit_.col(since - i);
      if (const Index after = since - column.value.size(); column.tail != 0 && after > 0) columns.col(j) += column.tail * summed_.col(after);
    }
    return columns;
  }

  const LinearSystem& system_;
  const ExactStep& step_;
  const MotionBasis& motion_;
  Motion moves_;
  std::vector<MotionBasis::Phase> phases_;
  VectorXd from_;           // state at the first sample
  MatrixXd from_by_theta_;
  MatrixXd unit_, summed_;  // states after a unit spline, and their running sum
};

}  // namespace

RigidLoad rigid_load(const AeroelasticModel& model, const Conditions& conditions, const VectorXd& theta, const MotionBasis& motion, double dt,
                     const VectorXd& u, std::vector<Index> slopes_at, const RigidLoad::State& from) {
  const Rig& rig = model.rig();
  if (rig.is_modal()) throw std::invalid_argument("a modal rig has no section to load");
  const double b = rig.semichord(), U = conditions.speed, length = rig.strip_length * static_cast<double>(rig.submerged.size());
  const RowVectorXd downwash = (RowVectorXd(3) << U, (0.5 - rig.axis()) * b, 0).finished();
  const LinearSystem lags = lag_system(model.circulation().rate, U, b, downwash);
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

  const Lags state(lags, step, motion, u, from);
  const MatrixXd all = state.follow(loads);
  RigidLoad load;
  load.circulatory = all.col(0);
  load.normal_force = all.col(1);

  if (slopes_at.empty()) {
    slopes_at.resize(static_cast<std::size_t>(samples));
    std::iota(slopes_at.begin(), slopes_at.end(), Index{0});
  }
  const auto rows = static_cast<Index>(slopes_at.size());
  load.circulatory_by_motion.resize(rows, motion.unknowns());
  load.normal_force_by_motion.resizeLike(load.circulatory_by_motion);
  load.circulatory_by_theta = MatrixXd::Zero(rows, theta.size());
  load.normal_force_by_theta = MatrixXd::Zero(rows, theta.size());
  const Index unknowns = motion.unknowns(), carried = from.by_theta.cols();
  const auto [behind, behind_slope] = state.at(slopes_at, [&](Index i, const VectorXd& x, const MatrixXd& its_slope) {
    load.circulatory_by_motion.row(i).noalias() = loads.row(0) * its_slope.leftCols(unknowns);
    load.normal_force_by_motion.row(i).noalias() = loads.row(1) * its_slope.leftCols(unknowns);
    const VectorXd still_missing = missing * x;
    for (Index k = 0; k < lags.lags; ++k)
      if (const Index parameter = model.circulation_parameter(k); parameter >= 0) load.circulatory_by_theta(i, parameter) = slope * strength * still_missing[k];
    load.circulatory_by_theta(i, model.index("normal_force_slope")) = strength * built_up.dot(x);
    load.normal_force_by_theta.row(i) = load.circulatory_by_theta.row(i);
    load.normal_force_by_theta(i, model.index("apparent_mass_coefficient")) += inertial.dot(x);
    if (carried == 0) return;
    load.circulatory_by_theta.row(i) += loads.row(0) * its_slope.rightCols(carried);
    load.normal_force_by_theta.row(i) += loads.row(1) * its_slope.rightCols(carried);
  });
  load.behind = {behind, behind_slope.leftCols(unknowns), behind_slope.rightCols(carried)};
  return load;
}

}  // namespace unrig
