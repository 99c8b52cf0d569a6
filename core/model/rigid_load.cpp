#include "core/model/rigid_load.h"

#include <algorithm>
#include <numeric>
#include <tuple>
#include <utility>
#include <vector>

#include "core/propagate/exact_step.h"
#include "core/propagate/response.h"
#include "core/model/rigid_system.h"

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::RowVectorXd;
using Eigen::VectorXd;

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
  const LinearSystem rigid = rigid_system(model, conditions, theta);
  const ExactStep step = exact_step(rigid, dt);
  const Index samples = motion.samples();
  const DualMatrix loads = rigid.C.block(0, 0, 2, rigid.states());  // circulatory, normal_force

  const Lags state(rigid, step, motion, u, from);
  const MatrixXd all = state.follow(loads.value);
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
    load.circulatory_by_motion.row(i).noalias() = loads.value.row(0) * its_slope.leftCols(unknowns);
    load.normal_force_by_motion.row(i).noalias() = loads.value.row(1) * its_slope.leftCols(unknowns);
    for (Index j = 0; j < theta.size(); ++j) {
      if (!loads.depends_on(j)) continue;
      load.circulatory_by_theta(i, j) = loads.d(j).row(0).dot(x);
      load.normal_force_by_theta(i, j) = loads.d(j).row(1).dot(x);
    }
    if (carried == 0) return;
    load.circulatory_by_theta.row(i) += loads.value.row(0) * its_slope.rightCols(carried);
    load.normal_force_by_theta.row(i) += loads.value.row(1) * its_slope.rightCols(carried);
  });
  load.behind = {behind, behind_slope.leftCols(unknowns), behind_slope.rightCols(carried)};
  return load;
}

}  // namespace unrig
