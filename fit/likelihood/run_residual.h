#pragma once
#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/model/aeroelastic_model.h"
#include "core/run/motion.h"
#include "core/propagate/response.h"
#include "core/run/run.h"
#include "fit/likelihood/coarse_converter.h"
#include "fit/likelihood/noise_colour.h"
#include "fit/likelihood/rest_rows.h"

namespace unrig {

namespace run_rows {
class Block;
struct Rotated;
}  // namespace run_rows

/// How a run is held against the model.
struct RunOptions {
  Eigen::Index horizon = 0;  ///< samples after the onset (first motion, else the first sample) that count; 0: all of them
  std::optional<Conditions> conditions = {};  ///< those of the whole record, of a run that is a part of one; none: its own
  bool free_memories = false;  ///< whether the memories of laws begin anyhow, as in a record that was begun in full swing; otherwise at zero
};

/// One run against the model: residuals of all fitted channels in units of their own noise, with everything that enters linearly solved for.
///
/// Linear unknowns c: motion (spline knots), initial state (free decays, forced and moved runs), a zero offset per channel (steady load
/// included), and the angle before the motion. Both the angle and the gauge are measured: sum over channels of
/// ((y_measured - y(theta, c)) / sigma)^2 is least over c for every theta (variable projection, Golub and Pereyra 1973), so that a nonlinear solver
/// sees only theta.
///
/// c is eliminated piece by piece, in time that goes with the record (fit/likelihood/chain_eliminator.h): a piece is a rest, or the samples of some 32 knots. The rows of a prior on
/// the motion (set_motion_prior) belong to pieces too; where one holds knots together that are farther apart, all of c is eliminated at once, and the cost goes with the cube of the knots.
///
/// With nonlinear effects at work the linear unknowns enter nonlinearly too, and c is searched for at every theta by Levenberg-Marquardt steps along exact
/// tangents (core/propagate/nonlinear_response.h): n x n x (n + knots of a piece) a sample and step.
///
/// Rests without jerk are compressed exactly: their rows span only the free response of the model, an n-dimensional space. Once its vibrations have died out
/// (below 1e-11), a stretch of 1024 samples is looked at as the few numbers that a polynomial needs (fit/likelihood/rest_rows.h), so that a long rest costs next to nothing.
class RunResidual {
 public:
  /// `motion`: windows in which the shaft may move (empty for runs without prescribed pitch).
  RunResidual(const AeroelasticModel& model, const Run& run, std::vector<MotionBasis::Window> motion, RunOptions options = {});

  /// At theta: P + 1 numbers whose squares sum to the least chi-square, and their derivative. Kaufman's Jacobian: its gradient is that of
  /// chi-square exactly, and J^T J is the Gauss-Newton Hessian with c eliminated. Infinite, with zero derivatives, where the model runs away from every c that was tried.
  struct Evaluation {
    double chi2 = 0;
    Eigen::VectorXd residual;  ///< P + 1
    Eigen::MatrixXd jacobian;  ///< (P + 1) x P, empty for Partials::none
    Eigen::VectorXd linear;    ///< c
    Eigen::MatrixXd linear_slope;   ///< d c / d theta, empty for Partials::none
    Eigen::MatrixXd linear_factor = {};  ///< for who fills it in, as `correct` does: RunResidual::linear_factor
    DualMatrix departure;           ///< state behind the last sample, n x 1, of a linear model; with c following theta
  };
  Evaluation evaluate(const Eigen::VectorXd& theta, Partials partials) const;

  /// The same in two steps, for solvers that want the derivative only where the value was good: everything that the value needed is kept.
  struct Linearised;
  struct Solution {
    Eigen::VectorXd theta;
    double chi2 = 0;
    Eigen::VectorXd linear;  ///< c
    std::shared_ptr<const Linearised> model;
    Eigen::VectorXd departure = {};  ///< state behind the last sample, of a linear model
  };
  Solution solve(const Eigen::VectorXd& theta) const;
  Evaluation differentiate(const Solution& solution) const;

  /// The first `samples` of the weighted residual measured - predicted at any theta and c, for searches that do not eliminate c; of runs whose motion is not
  /// estimated. Residual and slopes are compressed to P + (unknowns) + 1 rows at most with the same inner products; empty for Partials::none.
  struct SideBySide {
    double chi2 = 0;
    Eigen::VectorXd residual;
    Eigen::MatrixXd in_theta, in_c;  ///< its slopes; rows x P, rows x unknowns
  };
  SideBySide side_by_side(const Eigen::VectorXd& theta, const Eigen::VectorXd& linear, Eigen::Index samples, Partials partials) const;

  /// The fitted channels over the whole record, at theta and the c that belongs to it. Where the model runs away from every c that was tried, `output` is not a
  /// number, and the motion is the angle's own.
  struct Prediction {
    std::vector<std::string> channels;
    Eigen::MatrixXd output;        ///< samples x channels, offsets included
    Eigen::VectorXd angle_offset;  ///< the angle before the motion (1 number; empty without motion)
    Motion motion;                 ///< deviation from it; empty without prescribed pitch
    Eigen::VectorXd offset;        ///< per channel
    Eigen::VectorXd initial_state; ///< empty where steady
    Eigen::VectorXd linear;        ///< c
    Eigen::MatrixXd factor_behind_motion;  ///< R of what is known of the unknowns behind the motion's (initial state, offsets, angle before the motion), those of the motion eliminated, at fixed theta; else zero
  };
  Prediction predict(const Eigen::VectorXd& theta) const;

  /// The run to first order, for models with further laws (fit/likelihood/run_first_order.h).
  class FirstOrder;

  /// The largest argument that the law of each nonlinear effect sees at theta; empty for a linear model, zero where the model runs away.
  Eigen::VectorXd largest_arguments(const Eigen::VectorXd& theta) const;

  /// Parameters with respect to which `evaluate` differentiates; the other columns of the Jacobian are zero, and cost nothing. Empty: all.
  void differentiate_only(std::vector<Eigen::Index> parameters) {
    differentiated_ = std::move(parameters);
    last_evaluation_ = {};
  }

  /// Lets a run of a linear model go on from another part of its record: the state at its first sample, known beside what c adds to it, at the next theta that is asked for and with its
  /// derivatives where derivatives are.
  void arrive_in(DualMatrix state);
  /// Offsets of the channels and the angle before the motion, as far as the run has one, and R of what is known of them at fixed theta with the rest of c eliminated.
  struct Levels {
    Eigen::VectorXd value;
    Eigen::MatrixXd factor;
  };
  Levels levels(const Solution& solution) const;
  /// Reckons what is the same for all parts of a record once for itself and another part, of the same model and conditions.
  void share_responses_with(RunResidual& other);

  /// Sample by sample and in units of the noise: what is left, and how the prediction moves with theta while c follows. Left-out samples are 0.
  struct Sensitivity {
    struct PerChannel {
      Eigen::VectorXd residual;
      Eigen::MatrixXd slope;  ///< samples x P
      Eigen::VectorXd into_offset = {};  ///< what the noise of each sample does to the offset of the first channel, theta held
    };
    std::vector<PerChannel> channels;  ///< the fitted outputs, then the angle where the motion is estimated
  };
  Sensitivity sensitivity(const Eigen::VectorXd& theta) const;

  /// R, upper triangular, with R^T R the information matrix of c at fixed theta; zero where the model runs away. Its cost goes with the cube of the unknowns.
  Eigen::MatrixXd linear_factor(const Solution& solution) const;
  /// Rows over the motion's unknowns by the piece in which the last of them begins, over the splines that act there.
  struct MotionRows {
    std::vector<Eigen::MatrixXd> rows;  ///< none where one reaches farther back than these
    std::vector<std::vector<Eigen::Index>> number;  ///< of each of them among all
    Eigen::MatrixXd all;
  };
  MotionRows by_piece(Eigen::MatrixXd rows) const;
  /// c with least chi-square beside further rows of the motion, held against zero, to first order about a solution without a prior; and the variance of what c makes of each row. `scale`: of each row.
  struct HeldMotion {
    Eigen::VectorXd linear, variance;
  };
  HeldMotion hold_motion(const Solution& solution, const MotionRows& rows, const Eigen::VectorXd& scale) const;
  /// Rows over c that are held against zero beside the data (motion_prior); they count in chi-square. Empty: none.
  void set_motion_prior(const Eigen::MatrixXd& rows);

  const Run& run() const { return *run_; }
  const AeroelasticModel& model() const { return *model_; }
  const Conditions& conditions() const { return conditions_; }
  const MotionBasis& motion() const { return motion_; }
  const std::vector<std::string>& channels() const { return channels_; }
  double sigma(std::size_t channel) const { return sigma_[channel]; }
  /// What reads a channel, where that is coarse beside its noise.
  const CoarseConverter& converter(std::size_t channel) const { return converter_[channel]; }
  double angle_sigma() const { return angle_sigma_; }
  /// Samples with a weight, over all channels and the angle, minus linear unknowns.
  Eigen::Index degrees_of_freedom() const;
  Eigen::Index observations() const;
  Eigen::Index linear_unknowns() const { return unknowns_; }
  Eigen::Index first_offset() const { return first_offset_; }  ///< where in c the channels' offsets begin
  /// Angle samples left out as spikes.
  Eigen::Index spikes() const { return spikes_; }

  /// Leaves out angle samples that lie more than `limit` sigma from the fitted motion, alone or in pairs: three in a row are no electrical spike but
  /// a motion that the model forces away from the measured one. Returns how many were newly left out.
  Eigen::Index reject_spikes(const Eigen::VectorXd& theta, double limit = 5);

  /// The same run with other windows of motion; noise levels and samples left out stay as they are.
  RunResidual with_motion(std::vector<MotionBasis::Window> windows) const;

  /// Starts the search for c, where it needs one, from that of the same run held against another model or over another horizon.
  void start_from(const RunResidual& other) {
    if (other.last_linear_.size() == unknowns_) start_from(other.last_linear_);
  }

  void start_from(const Eigen::VectorXd& linear) {
    last_linear_ = linear;
    guide_ = {};
    forget_solutions();
  }

  /// Takes over noise levels and samples left out from the same run held against another model.
  void keep_noise_of(const RunResidual& other);

  /// Takes the noise of each channel from what the model at theta leaves of it, where that is less: differences of the raw channel keep some of
  /// a fast signal. Differences do not see a slow mismatch: of first order (the most
  /// efficient), unless those of third order are smaller by more than chance. A coarse converter's error is what it is at rest, half a step at most, and may be more than before.
  void settle_noise(const Eigen::VectorXd& theta);

  /// Whether a colour can be set: where noise of no measured input colours the readings already, and the model goes on from no other part.
  bool may_be_coloured() const;
  using Colours = std::vector<std::optional<NoiseColour>>;
  /// The colour of each channel's noise in what the model at theta leaves of it at rest (fit/likelihood/noise_colour.h); where others have shown what to expect, that in this run's size.
  Colours colours(const Eigen::VectorXd& theta, const std::vector<ChannelColour>& expected) const;
  /// Readings and model are compared behind the filter that makes such noise white from then on; its state at the first sample joins c. The prior on the motion goes away. Of a run whose
  /// noise was white so far. Left-out readings are filled by what the model at theta says.
  void set_colours(const Eigen::VectorXd& theta, const Colours& colours);
  /// Logarithm of the density of the readings' noise where all innovations are 0, and of the noise's own state at the first sample, but for constants.
  double log_noise_density() const;
  /// What is left of a channel at rest; elsewhere, and where a reading does not count, not a number. Knots as close as samples take the noise while the shaft moves.
  Eigen::VectorXd at_rest(Eigen::VectorXd left, const Eigen::VectorXd& weight) const;
  /// Root mean square of a channel's noise of all colours [SI].
  double noise(std::size_t channel) const { return colour_.empty() || !colour_[channel] ? sigma_[channel] : std::sqrt(colour_[channel]->variance()); }
  /// The colour of a channel's noise; null where it is white.
  const NoiseColour* colour(std::size_t channel) const { return colour_.empty() || !colour_[channel] ? nullptr : &*colour_[channel]; }

  /// All readings but the angle's as if their scale were another.
  void scale_readings(double factor) {
    measured_ *= factor;
    whitened_ *= factor;
    weights_changed();
  }

  /// Lets every fitted channel count as if its noise were `factor` times what it is; replaces an earlier factor. While physics is missing, runs that it is far from
  /// explaining must not drown the others.
  void temper(double factor) {
    weight_ *= tempered_ / factor;
    tempered_ = factor;
    weights_changed();
  }
  double tempered() const { return tempered_; }

  /// Counts for nothing in a joint fit, which neither follows it nor moves for it: a decay whose trajectory crosses the corners of a law for so long that no search follows it.
  void set_aside(bool aside) { aside_ = aside; }
  bool is_aside() const { return aside_; }

  /// A glance at a nonlinear run: c in two steps, and the model in as many steps a sample as `finer` says, whatever its laws ask for. Enough to compare starts and candidates.
  void glance(bool only) {
    if (glance_ != only) forget_solutions();
    glance_ = only;
  }

  /// Follows nonlinear laws in so many times the steps that they ask for.
  void follow_in(Eigen::Index times) {
    finer_ = times;
    forget_solutions();
  }
  Eigen::Index finer() const { return finer_; }

  /// Moves c of a nonlinear run to the least chi-square that exact tangents reach over a record that grows, at theta. For decays, and for laws with
  /// corners that the rig crosses all the time (freeplay); `thoroughly`: in smaller strides too where that does not follow the run, which at this
  /// theta it should. False, and nothing done, where the model is linear.
  bool find_linear(const Eigen::VectorXd& theta, bool thoroughly = false);
  /// Whether following the model takes several steps a sample, which makes exact tangents dear.
  bool takes_small_steps(const Eigen::VectorXd& theta) const;

  /// How near c of a nonlinear run is searched to its least chi-square, in standard errors. The slopes of chi-square in theta do not feel what is left: they are
  /// taken across the directions of c.
  void search_linear_to(double precision) {
    if (precision < linear_precision_) forget_solutions();
    linear_precision_ = precision;
  }

  /// States that the run may start with: behind the motion's unknowns in c, before the offsets.
  const std::vector<Eigen::Index>& free_states() const { return free_; }

  Eigen::VectorXd channel_weight(std::size_t channel) const { return weight_.col(static_cast<Eigen::Index>(channel)); }
  const Eigen::VectorXd& angle_weight() const { return angle_weight_; }

 private:
  /// Motion unknowns whose splines act in some samples: [still, begin) begin before them, [begin, end) in them.
  struct Splines {
    Eigen::Index still = 0, begin = 0, end = 0;
    Eigen::Index open() const { return begin - still; }
    Eigen::Index own() const { return end - begin; }
    Eigen::Index all() const { return end - still; }
  };
  /// A phase, or some samples of a long motion: what one link of the elimination stands for.
  struct Piece {
    Interval samples;
    bool moving = false;
    bool stands_still = false;  ///< the shaft, behind it
    Splines splines;
  };
  std::shared_ptr<Linearised> linearise(const Eigen::VectorXd& theta) const;
  void weights_changed();
  void lay_out();
  void take_colour(const RunResidual& other);
  Eigen::MatrixXd colour_rows() const;
  void filter_output(LinearSystem& system, ExactStep& step) const;
  using FilterStates = std::vector<Eigen::MatrixXd>;
  Eigen::Index filter_states() const;
  FilterStates filters_at(const Eigen::MatrixXd& state) const;
  void filter_outputs(std::size_t channel, Eigen::Ref<Eigen::MatrixXd> columns, FilterStates& states) const;
  const Eigen::MatrixXd& readings() const { return whitened_.size() > 0 ? whitened_ : measured_; }
  void forget_solutions() {
    last_solution_ = {};
    last_evaluation_ = {};
  }
  void stack_rows(Linearised& lin) const;
  Eigen::VectorXd whole_jerk(const Eigen::VectorXd& linear) const;
  bool stack_nonlinear_rows(Linearised& lin, const Eigen::VectorXd& theta, const Eigen::VectorXd& linear) const;
  struct NonlinearPoint;
  Eigen::VectorXd as_the_angle_says() const;
  NonlinearPoint along_growing_record(const Linearised& lin, const Eigen::VectorXd& theta, NonlinearPoint point) const;
  NonlinearPoint first_nonlinear_point(const Linearised& lin, const Eigen::VectorXd& theta) const;
  bool worth_going_on(double promised, double chi2) const;
  NonlinearPoint nonlinear_point(const Linearised& lin, const Eigen::VectorXd& theta, const Eigen::VectorXd& linear) const;
  Eigen::VectorXd without_laws(const Linearised& lin) const;
  void solve_nonlinear(Linearised& lin, const Eigen::VectorXd& theta) const;
  bool search_along_tangents(Linearised& lin, const Eigen::VectorXd& theta, NonlinearPoint point, int most) const;
  int most_steps() const;
  void search_from_the_beginning(Linearised& lin, const Eigen::VectorXd& theta) const;
  void add_prediction_slope(const Linearised& lin, const run_rows::Block& block, const Eigen::MatrixXd& linear_slope, Eigen::MatrixXd& slope) const;
  void prepare_linear(Linearised& lin) const;
  Eigen::Index longest_piece(bool moving) const;
  Eigen::Index samples_of_free_response() const;
  using TakeRows = std::function<void(std::size_t block, const Interval& samples, Eigen::MatrixXd rows)>;
  DualMatrix follow_partials(const Eigen::VectorXd& theta, const Eigen::VectorXd& linear, const std::vector<run_rows::Block>& blocks, const TakeRows& take) const;
  void follow_nonlinear_partials(const LinearSystem& system, const Eigen::VectorXd& theta, const Eigen::VectorXd& linear, const TakeRows& take) const;
  Eigen::MatrixXd jerk_slope(const Interval& samples) const;
  LinearSystem searched_system(const Eigen::VectorXd& theta) const;
  LinearSystem differentiable_system(const Eigen::VectorXd& theta, const std::vector<Eigen::Index>& parameters) const;
  void cut_phases();
  Eigen::Index longest_stride() const;
  Splines splines_in(const Interval& samples) const;
  Eigen::Index first_open(Eigen::Index at) const;
  Eigen::VectorXd motion_state(const Linearised& lin, Eigen::Index spline, Eigen::Index at) const;
  Eigen::MatrixXd state_behind(const Linearised& lin, const Piece& piece, const Interval& samples, const Eigen::MatrixXd& leap, const Eigen::MatrixXd& start) const;
  Eigen::MatrixXd motion_states(const Linearised& lin, Eigen::Index first, Eigen::Index last, Eigen::Index at) const;
  Eigen::MatrixXd transition(const Piece& piece, bool has_state, const Splines& next, const Eigen::MatrixXd& leap, const Eigen::MatrixXd& by_splines) const;
  Eigen::RowVectorXd level_before(Eigen::Index spline) const;
  std::size_t counted_pieces() const;
  bool has_state(const Piece& piece, const Eigen::MatrixXd& start) const { return piece.splines.begin > 0 || !start.isZero(0); }
  Eigen::MatrixXd link_rows(const Piece& piece, bool has_state, const Eigen::MatrixXd& acting, const Eigen::MatrixXd& states, const Eigen::MatrixXd& shared, Eigen::Index first_shared) const;
  Eigen::MatrixXd over_c(const Piece& piece, bool has_state, const Eigen::MatrixXd& rows, const Eigen::MatrixXd& start) const;
  Eigen::Index smooth_from(const Linearised& lin, const Interval& samples, const Eigen::MatrixXd& start) const;
  Eigen::MatrixXd rows_at_rest(const Linearised& lin, const Piece& piece, bool has_state, run_rows::Block& block) const;
  Eigen::MatrixXd rows_in_motion(const Linearised& lin, const Piece& piece, bool has_state, run_rows::Block& block) const;
  run_rows::Rotated rotated_readings(const Linearised& lin, const run_rows::Block& block, double& beside) const;
  const rest_rows::SmoothReadings& smooth_readings(Eigen::Index channel, const Interval& stretch) const;
  Interval counted(const Interval& samples) const { return {samples.first, std::min(samples.last, last_sample_)}; }
  Eigen::MatrixXd motion_output_columns(const Linearised& lin, Eigen::Index channel, const Interval& samples, const Splines& splines) const;
  Eigen::MatrixXd angle_rows() const;
  Eigen::VectorXd angle_residual(std::size_t piece, const Eigen::VectorXd& linear) const;
  bool is_linked() const { return motion_prior_.rows() == 0 || !prior_rows_.empty(); }
  Eigen::MatrixXd held_rows() const;
  Eigen::VectorXd held_residual(const Eigen::VectorXd& linear) const;
  Eigen::VectorXd initial_state(const Eigen::VectorXd& linear, Eigen::Index states) const;
  double arrival_angle(const LinearSystem& system) const { return arrival_.rows() > 0 ? arrival_.value(system.motion, 0) : 0; }
  void prepare_angle_rows();

  const AeroelasticModel* model_;
  const Run* run_;
  Conditions conditions_;
  std::vector<std::string> channels_;
  MotionBasis motion_;
  std::vector<MotionBasis::Phase> phases_;
  std::vector<Piece> pieces_;
  Eigen::MatrixXd measured_;  ///< samples x channels, missing samples 0
  Eigen::MatrixXd weight_;    ///< 1 / sigma, 0 where left out
  std::vector<double> sigma_;
  std::vector<CoarseConverter> converter_;
  std::vector<std::optional<NoiseColour>> colour_;  ///< by channel; empty: all are white
  std::vector<WhiteningFilter> filters_;            ///< of the coloured channels, in turn
  Eigen::MatrixXd whitened_;                        ///< measured_ behind the filters, empty without
  double tempered_ = 1;
  bool from_afar_ = false, thorough_ = false, aside_ = false;
  Eigen::VectorXd angle_, angle_weight_;
  double angle_sigma_ = 0;
  struct SharedResponses;
  std::shared_ptr<SharedResponses> shared_;
  DualMatrix arrival_;            ///< empty where the run begins of its own
  Eigen::MatrixXd motion_prior_;  ///< [c | 0]
  std::vector<Eigen::MatrixXd> prior_rows_;  ///< the same by piece, over the splines that act in it; none where a row reaches farther
  std::vector<Eigen::MatrixXd> angle_rows_;  ///< by piece, weighted, [splines that act in it | level of the earlier ones | angle before the motion | angle]; they do not depend on theta
  std::vector<Eigen::Index> differentiated_;
  Eigen::MatrixXd inputs_;  ///< samples + 1 rows
  mutable std::map<std::pair<Eigen::Index, Eigen::Index>, rest_rows::SmoothReadings> smooth_readings_;  ///< by channel and first sample, where they were asked for
  Eigen::Index spikes_ = 0;
  Eigen::Index last_sample_ = 0;

  /// The last theta that was asked for, of a nonlinear model where the search for c arrived; and the derivatives there.
  mutable Solution last_solution_;
  mutable Evaluation last_evaluation_;

  /// From where the search for c starts in a nonlinear run: c of the last solution, and that of the last one whose derivatives are known.
  mutable Eigen::VectorXd last_linear_;
  mutable int in_vain_ = 0;  ///< searches from the beginning, one after the other
  struct Guide {
    Eigen::VectorXd theta, linear;
    Eigen::MatrixXd slope;  ///< d c / d theta
    double chi2 = 0;
  };
  mutable Guide guide_;
  double linear_precision_ = 3e-3;
  bool glance_ = false;
  Eigen::Index finer_ = 1;

  // Layout of c.
  Eigen::Index states_ = 0;         ///< of the model; those of the filters stand behind them
  std::vector<Eigen::Index> free_;  ///< states whose initial value is unknown
  Eigen::Index unknowns_ = 0;
  Eigen::Index first_state_ = 0, first_offset_ = 0, angle_offset_ = -1;
};

/// Knots of a motion in so many windows, at most; more samples make them sparser.
Eigen::Index most_knots(std::size_t windows);

/// Windows in which the shaft of a run moves, from its angle channel, with room before and after; empty for runs without prescribed pitch.
std::vector<MotionBasis::Window> motion_windows(const Run& run);

/// The same for a fit, whose cost goes with the knots alone: as close as the angle shows that it needs them (off_its_knots), `most_knots_to_fit` at most.
std::vector<MotionBasis::Window> windows_to_fit(const Run& run);
constexpr Eigen::Index most_knots_to_fit = 2000;

/// Root mean square of how far the angle lies, in these windows, from the cubic through the samples half and three halves of `stride` away, over what its noise makes of that: 1 where knots so
/// far apart follow the motion. 0 where there is no such sample.
double off_its_knots(const Run& run, const std::vector<MotionBasis::Window>& windows, Eigen::Index stride);

}  // namespace unrig
