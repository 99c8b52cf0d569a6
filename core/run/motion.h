#pragma once
#include <Eigen/Core>
#include <vector>

namespace unrig {

/// Samples [first, last) of a run.
struct Interval {
  Eigen::Index first = 0;
  Eigen::Index last = 0;
  Eigen::Index length() const { return last - first; }
};

/// Prescribed pitch as a uniform cubic spline with its knots on the samples, free inside a few windows and constant outside them.
///
/// p(t) = sum_j c_j B((t - t_j)/dt), B the cubic B-spline on [0, 4] with unit integral; p is the deviation from the angle before the first
/// window. The fine coefficients c are few unknowns u: inside a window one per `stride` samples, after it one level until the next window:
/// c = S u. Coarser splines (stride s > 1) are exact sums of fine ones (two-scale relation), so that the propagator only knows fine jerks.
class MotionBasis {
 public:
  struct Window {
    Interval knots;  ///< free fine knots [first, last)
    Eigen::Index stride = 1;
  };
  MotionBasis(Eigen::Index samples, std::vector<Window> windows);

  Eigen::Index samples() const { return samples_; }
  Eigen::Index unknowns() const { return static_cast<Eigen::Index>(columns_.size()); }
  const std::vector<Window>& windows() const { return windows_; }
  /// Samples during which the jerk may differ from zero, one interval per window.
  std::vector<Interval> active() const;
  /// The record in turn: intervals in which the shaft moves, those of windows whose splines overlap as one, and the rests between.
  struct Phase {
    Interval samples;
    bool moving;
  };
  std::vector<Phase> phases() const;

  /// A column of S: fine coefficients `value` from fine knot `first` on; a level continues with `tail` to the end of the record.
  struct Column {
    Eigen::Index first = 0;
    Eigen::VectorXd value;
    double tail = 0;
  };
  const std::vector<Column>& columns() const { return columns_; }

  Eigen::VectorXd coefficients(const Eigen::VectorXd& u) const;  ///< fine coefficients, one per sample
  Eigen::MatrixXd angle_columns(Interval samples) const { return angle_columns(samples, 0, unknowns()); }  ///< d p / d u at these samples
  Eigen::MatrixXd angle_columns(Interval samples, Eigen::Index first, Eigen::Index last) const;             ///< of unknowns [first, last)

 private:
  Eigen::Index samples_;
  std::vector<Window> windows_;
  std::vector<Column> columns_;
};

/// Angle, rate, acceleration at every sample and jerk over every step of the spline with fine coefficients c.
struct Motion {
  Eigen::VectorXd angle, rate, acceleration, jerk;
};
Motion motion_of(const Eigen::VectorXd& coefficients, double dt);

/// The cubic spline through samples of an angle (three at least, all finite), with its knots on them, as deviation from the first sample: for
/// motions that are known rather than measured, since noise in the samples becomes acceleration divided by dt^2.
/// It starts at rest, with zero rate at the first sample, and its acceleration is constant over the last step. Between samples of a smooth
/// motion it is off by about dt^4/384 of its fourth derivative, and its acceleration at the samples by dt^2/12 of it.
Motion interpolated_motion(const Eigen::VectorXd& angle, double dt);

/// Standard deviation of the white part of a channel: from its differences of order `order`, scaled by their gain sqrt(C(2 order, order)), cut
/// off at 3.5 of their median so that transients and spikes do not count; at 10 where what is beyond 3.5 comes all over the record, as in noise with heavy tails. A slowly varying signal is suppressed by (2 sin(omega dt/2))^order. Missing
/// samples are left out. A channel that is quantised more coarsely than its noise returns `rounding_level`.
double noise_level(const Eigen::VectorXd& channel, int order = 6);

/// quantum/sqrt(12) of a channel from a coarse converter, whose smallest changes are all of one size; 0 where they are not.
double rounding_level(const Eigen::VectorXd& channel);

/// Isolated electrical spikes: samples that differ by more than `limit` sigma from the median of the five around them or, where the shaft moves
/// (inside `motion`), from the cubic through two neighbours on either side, provided that without them all neighbours lie on theirs: a motion too
/// fast for its samples is no spike. Returns true where a sample should be left out.
std::vector<bool> isolated_spikes(const Eigen::VectorXd& channel, double sigma, const std::vector<Interval>& motion, double limit = 6);

/// Where the shaft moves: samples whose median-filtered angle changes by more than the noise allows within six, merged where they nearly touch, and widened where they hardly stand out
/// of it; and, far from these, where its means over 16, 64 or 256 samples change by more than noise and wandering do elsewhere. The whole record where they change smoothly nearly everywhere.
std::vector<Interval> moving(const Eigen::VectorXd& angle, double sigma);

}  // namespace unrig
