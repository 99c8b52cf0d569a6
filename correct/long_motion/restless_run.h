#pragma once
#include <Eigen/Core>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/model/aeroelastic_model.h"
#include "core/numerics/convolution.h"
#include "core/run/run.h"
#include "correct/long_motion/loaded_system.h"
#include "correct/estimate/prior.h"
#include "correct/long_motion/settled_smoother.h"
#include "correct/long_motion/variance_in_gaps.h"

namespace unrig {

/// A run in which the shaft hardly ever rests, against the model: as RunResidual, with a knot of the motion on every sample, in time n ln n and memory n.
///
/// The fine coefficients c of the angle's cubic spline are a random walk of third differences, d4 c = tau w with w white of variance 1: the fit's prior of the motion
/// (fit/likelihood/motion_prior.h) with one roughness tau for the whole record. The jerk, d3 c / dt^3, becomes one more state,
///
///   x_(k+1) = T x_k + J j_k,   j_k = j_(k-1) + tau w_k / dt^3,   gauge_k = C x_k + offset,   angle_k = p_k + offset,
///
/// with the exact step T, J of the rig, its lags and those of a rigid section beside it (correct/long_motion/loaded_system.h). At a given theta the motion is then the mean of these states for given
/// readings (correct/long_motion/settled_smoother.h), and what is left, chi-square over data and prior with motion and offsets eliminated, is the sum of squares of the innovations e(y), a
/// linear function of the readings. By Kaufman's rule, as there, the slopes of these residuals are -e(s_j) beside what the offsets reach, s_j = (d gauge / d theta_j) of the
/// estimated motion: a convolution of its c with the derivative of the response to one spline. Long records are taken piece by piece (core/numerics/convolution.h), and these slopes, which are as smooth as
/// the estimated motion is, are looked at on every few samples (`looked`) where squares of them are summed; what they have in common with the readings is summed over all.
///
/// Chi-square with the motion eliminated is least where the motion takes most of the noise upon itself: it is less by the freedom of the motion, the readings that it takes to determine it,
///
///   nu = n mean over w of (1 - Pi / D),   D = |G|^2 / r + |A|^2 / r_a + Pi,   Pi = |1 - e^-iw|^8 / tau^2,
///
/// with what a spline does to gauge and angle, G and A. What theta moves of it grows with the record, what a motion's beginning says of theta does not: chi-square + nu is made least, of whose
/// slopes at the true theta the noise's part is zero on average (that of E d chi2 / d theta is -d nu / d theta); what the smoother flattens of the motion itself remains. Only samples of which nothing
/// is missing count in n.
///
/// The shaft is taken to have been on its way before the first sample, as uncertain there as later for given past, and the section is steady there. Missing samples are filled with what the smoother
/// finds there without them: the readings that make chi-square least, or nearly so in long gaps of long records (settle_missing). What gaps of more than `unnoticed` samples leave open of the loads is
/// added to their bands (correct/long_motion/variance_in_gaps.h); the slopes of chi-square count all as if they were there, which who asks for bands has to make up for.
class RestlessRun {
 public:
  /// Records of more samples than `in_one_piece` are taken piece by piece.
  RestlessRun(const AeroelasticModel& model, const Run& run, Eigen::Index in_one_piece = 1 << 16);

  /// What is to be least, chi-square and the motion's freedom; infinite where the rig would flutter or diverge within the record.
  RunResidual::Solution solve(const Eigen::VectorXd& theta) const;
  /// Derivatives with respect to `parameters`; the other columns are zero. `linear`: offsets, angle before the motion, signals of effects. Throws NoAnswer where the model does not stay finite.
  RunResidual::Evaluation differentiate(const RunResidual::Solution& solution, const std::vector<Eigen::Index>& parameters) const;

  /// Missing samples as they make chi-square least at theta: by conjugate gradients, the gradient being what the smoother leaves of them over the noise's variance. Returns by how much chi-square falls.
  double settle_missing(const Eigen::VectorXd& theta);
  /// Noise of each channel from what the model at theta leaves of it, where that is less; angle samples that stand alone are left out, missing ones filled.
  void settle_noise(const Eigen::VectorXd& theta);
  /// tau that makes the readings most probable at theta. `near`: only within a quarter of a decade of what it is, as long as it is found there.
  enum class Look { everywhere, near };
  void settle_roughness(const Eigen::VectorXd& theta, Look look);
  /// Takes over what the same run, or a part of it, has settled on.
  void take_roughness_of(const RestlessRun& other) { roughness_ = other.roughness_; }

  /// Everything known at one theta.
  struct Point {
    Eigen::VectorXd theta;
    LinearSystem system;  ///< without partials
    std::optional<SettledSmoother> smoother;
    std::vector<Eigen::MatrixXd> signals;  ///< what one of each exogenous state does, samples x channels
    Eigen::MatrixXd white_columns;         ///< innovations of what one of each linear unknown does: samples times channels x linear unknowns
    Eigen::MatrixXd linear_factor;         ///< their triangle
    Eigen::VectorXd linear;
    Eigen::MatrixXd left;                  ///< readings without what they reach, samples x channels
    Eigen::MatrixXd white;                 ///< innovations of that
    double chi2 = 0, log_determinant = 0;
    Eigen::VectorXd precision;             ///< of a spline's coefficient far from the ends, by lines of the spectrum: |G|^2 / r + |A|^2 / r_a + Pi, Pi = |1 - e^-iw|^8 / tau^2
    double freedom = 0;                    ///< of the motion: samples times the mean of 1 - Pi / precision
    Eigen::MatrixXcd frees;                ///< lines of the spectrum x outputs: times what a spline does to them by a parameter, summed over both, what that parameter does to the freedom
    double objective() const { return chi2 + freedom; }
  };
  const Point& at(const Eigen::VectorXd& theta) const;
  /// Lets go of all that is as long as the record, here and in the last point: filter and smoother stay.
  void forget_readings();
  /// By how many powers of e the rig's least stable motion in the stream grows over the record; negative where all decay.
  double growth(const Eigen::VectorXd& theta) const;
  /// Rows over the filter's states, at the sample where they stand.
  Eigen::RowVectorXd row(const Eigen::RowVectorXd& over_model_states) const;
  /// What one of linear unknown j does: samples x channels.
  Eigen::MatrixXd column(const Point& point, Eigen::Index j) const;
  /// Spline coefficients of the motion as deviation from the first, for convolution with spline responses.
  Eigen::VectorXd motion(const Point& point) const;
  /// Derivatives of the readings, samples x channels, and of the loads at the samples asked for, with that motion, with respect to a parameter.
  struct Slope {
    Eigen::MatrixXd readings, loads;
    double freedom = 0;
  };
  /// Hands them to `take` with the parameter's place among `parameters`, from several threads at once. No `at`: no loads.
  void slopes(const Point& point, const Eigen::VectorXd& motion, const std::vector<Eigen::Index>& parameters, const std::vector<Eigen::Index>& at,
              const std::function<void(Eigen::Index place, Slope slope)>& take) const;
  /// Samples that say all of a slope, and how many each stands for. In a long record they lie one radian apart of the fastest that the angle shows, w = roughness^(1/4); behind that the smoother
  /// lets (roughness / w^4)^2 through. At both ends, where a record may break off in the middle of a motion, every sample.
  struct Looked {
    std::vector<Eigen::Index> at;
    Eigen::VectorXd weight;
  };
  Looked looked() const;

  Eigen::Index outputs() const { return static_cast<Eigen::Index>(channels_.size()); }  ///< fitted channels but the angle, which comes last
  Eigen::Index samples() const { return run_->samples(); }
  Eigen::Index observations() const { return observations_; }
  Eigen::Index whole_samples() const { return whole_; }  ///< of which nothing is missing
  Eigen::Index motion_state() const { return motion_state_; }
  const Eigen::VectorXd& sigma() const { return sigma_; }
  double roughness() const { return roughness_; }  ///< tau over the noise of the angle
  double dt() const { return run_->dt; }
  const Conditions& conditions() const { return conditions_; }
  /// What gaps of more than some samples add to the variance of quantities (rows over the filter's states): samples x quantities, empty without such gaps.
  Eigen::MatrixXd variance_in_gaps(const Point& point, const Eigen::MatrixXd& rows) const;
  static constexpr Eigen::Index unnoticed = 5;  ///< missing samples in a row
  Eigen::Index longest_gap() const { return longest_gap_; }
  double longest_gap_at() const { return longest_gap_at_; }  ///< s

 private:
  void set_freedom(Point& point, const ExactStep& step) const;
  std::shared_ptr<Point> point_at(const Eigen::VectorXd& theta) const;
  void fill_between_neighbours();
  /// What the smoother leaves of readings with these innovations, samples x channels.
  struct Reader;
  Eigen::MatrixXd left_by_smoother(const Point& point) const;
  Eigen::Index stride_of_motion() const;  ///< samples to a radian of the fastest that the angle shows
  std::shared_ptr<const Convolution> convolution_for(const Eigen::MatrixXd& L, const LinearSystem& system) const;
  std::vector<Eigen::Index> driven_states() const;

  const AeroelasticModel* model_;
  const Run* run_;
  Conditions conditions_;
  Eigen::Index in_one_piece_;
  std::vector<std::string> channels_;
  std::vector<Eigen::Index> kept_;       ///< states of the loaded system that the filter has: all but signals
  std::vector<Eigen::Index> exogenous_;
  Eigen::Index motion_state_ = 0;
  Eigen::MatrixXd inputs_;               ///< measured inputs
  Eigen::MatrixXd measured_;             ///< samples x channels, the angle from its level
  Missing missing_;
  Eigen::VectorXd sigma_;
  double roughness_ = 0.1;
  Eigen::Index observations_ = 0, longest_gap_ = 0, whole_ = 0;  ///< whole_: samples of which nothing is missing
  double longest_gap_at_ = 0;
  mutable std::shared_ptr<const Convolution> convolution_;
  mutable std::shared_ptr<Point> last_;
};

}  // namespace unrig
