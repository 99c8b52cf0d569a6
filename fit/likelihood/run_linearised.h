#pragma once
#include <memory>
#include <mutex>
#include <optional>
#include <utility>
#include <vector>

#include "core/propagate/exact_step.h"
#include "core/numerics/householder.h"
#include "fit/likelihood/chain_eliminator.h"
#include "fit/likelihood/rest_rows.h"
#include "fit/likelihood/run_residual.h"

// What RunResidual's arithmetic shares between its linear and its nonlinear path. Not for others to include.

namespace unrig {

class InputNoise;
struct InputNoiseModel;
class WanderingForce;

namespace run_rows {

/// Weighted rows of a block on their way through its rotations: those that c reaches, and what is left of the others.
struct Rotated {
  std::vector<Eigen::MatrixXd> kept, others;
};

/// One channel over one piece of the record. One at rest spans only the free response and the offset: its rows are rotated, stretch by stretch and then those kept of
/// all stretches together, so that few of them hold all that c can reach, and the others only what is left. One in which the shaft moves is rotated where its
/// own splines, the free response and the offset are clearly fewer than its samples.
class Block {
 public:
  using Rotation = std::shared_ptr<const Householder>;

  Interval samples;
  bool moving = false;
  Eigen::Index channel = 0;
  Eigen::MatrixXd start;         ///< d state / d c at the start, of a linear system without the splines that act still; behind it, where the run goes on from another part, the state that it arrived in
  Eigen::MatrixXd rows;          ///< nonlinear systems: d y / d [state at the start (none where nothing has moved it) | splines that act]
  Eigen::Index smooth_from = 0;  ///< at rest: the sample from which on whole stretches are polynomials; samples.last where none is

  Block(const Interval& of, bool moves, Eigen::Index in_channel, Eigen::MatrixXd from, Eigen::MatrixXd tangents, Eigen::Index smooth)
      : samples(of), moving(moves), channel(in_channel), start(std::move(from)), rows(std::move(tangents)), smooth_from(smooth) {}

  bool is_smooth(const Interval& stretch) const { return !moving && stretch.first >= smooth_from && stretch.length() == rest_rows::stretch_samples; }

  /// Sets up the rotation of the next stretch, from its weighted rows over [state at the phase's start | offset]; returns those kept.
  Eigen::MatrixXd add_stretch(Eigen::MatrixXd span);
  /// The same for a constant weight, from the rotation for a weight of one.
  Eigen::MatrixXd add_stretch(double weight, const Rotation& rotation);
  /// A stretch whose rows are few already.
  void add_smooth_stretch() { rotations_.emplace_back(); }
  /// Rotates the rows kept of all stretches together; returns them.
  Eigen::MatrixXd join(const std::vector<Eigen::MatrixXd>& spans);
  /// All of that from `rows`.
  Eigen::MatrixXd rotate_rows(const Eigen::VectorXd& w);

  /// Takes the rows of some of its samples, whole stretches of them.
  void rotate(const Interval& some, Eigen::MatrixXd all, Rotated& rotated) const;
  /// What c reaches of all rows taken; what is left joins the others.
  Eigen::MatrixXd reached(Rotated& rotated) const;

 private:
  std::vector<Rotation> rotations_;  // per stretch, or of the whole motion; none where the rows are few already
  Rotation joint_;                   // of what several stretches keep
};

}  // namespace run_rows

/// What follows from theta alone and is the same for all parts of a record: the free response without partials (of so many samples), and all responses with them. Kept for the theta that was asked for last.
struct RunResidual::SharedResponses {
  struct Rows {
    Eigen::VectorXd theta;
    Eigen::Index samples = 0;
    LinearSystem system;
    ExactStep step;
    std::vector<rest_rows::FreeRows> free;
    Eigen::MatrixXd leap;
  };
  struct Slopes {
    Eigen::VectorXd theta;
    std::vector<Eigen::Index> differentiated;
    LinearSystem system;
    ExactStep step;
    FreeResponse free;
    std::optional<rest_rows::SmoothResponse> smooth;  ///< where some part of a rest is looked at so
    std::shared_ptr<const WanderingForce> wandering;
  };
  std::mutex in_use;
  std::shared_ptr<const Rows> rows;
  std::shared_ptr<const Slopes> slopes;
  std::shared_ptr<const InputNoiseModel> input_noise;  ///< noise of the measured inputs (fit/likelihood/input_noise.h); none: they count as exact
  std::vector<double> white;  ///< of a run with a wandering force: standard deviation of each channel's white noise, beside that of its innovations (RunResidual::sigma_); empty: the same
};

/// The model at one theta, without partials: its exact step, what the inputs alone do, where the unknown motion takes the states, and the rows
/// of the linear unknowns.
struct RunResidual::Linearised {
  LinearSystem system;
  ExactStep step;
  Eigen::MatrixXd known;          // response to the measured inputs, samples x channels, empty without
  Eigen::MatrixXd spline;         // states after a unit spline, n x samples of the longest motion
  Eigen::MatrixXd spline_summed;  // and their running sum: states after splines at every sample
  Eigen::MatrixXd spline_output, spline_summed_output;  // what the channels read of both, channels x samples
  std::vector<rest_rows::FreeRows> free;  // free response per channel, for a stretch at rest or the longest motion
  Eigen::MatrixXd leap;                   // transition over a stretch at rest
  bool polynomials = false;               // whether what is left of a rest may be looked at as polynomials

  std::vector<run_rows::Block> blocks;  // piece by piece, channel by channel
  Eigen::MatrixXd end;                  // as their starts, behind the last sample
  bool linked = false;                  // whether each piece is a link of the elimination; else all rows are over c as a whole

  /// Rows of all pieces on their way into the elimination: as its links or, where a row of a prior on the motion reaches farther, over all of c at once.
  struct Rows {
    Rows(const RunResidual& run, bool linked);
    /// The state that a run begins in, from d state / d c there, which is not zero.
    void begin(const Eigen::MatrixXd& start);
    /// A channel's rows of the next piece, and what they are to be. `start`: d state / d c where the piece begins.
    void add(bool has_state, const Eigen::MatrixXd& of_link, const Eigen::MatrixXd& right, const Eigen::MatrixXd& start);
    /// Those of the angle, and the way from this piece to the one behind it.
    void end_piece(bool has_state, Eigen::MatrixXd transition);
    bool is_last() const { return at_ + 1 == links_.size(); }
    /// Solves for c, beside a sum of squares that c cannot reach.
    void settle(Linearised& lin, double unreachable);

   private:
    const RunResidual& run_;
    std::size_t at_ = 0;  // the piece
    Eigen::MatrixXd begin_;
    std::vector<run_rows::Link> links_;
    std::vector<Eigen::MatrixXd> right_;
    std::vector<Eigen::MatrixXd> own_, own_right_;  // of the piece
    std::vector<Eigen::MatrixXd> whole_;            // [c | y]
    bool linked_;
  };
  /// Solves the stacked rows [c | y] for c, beside a sum of squares that c cannot reach.
  void settle(const std::vector<Eigen::MatrixXd>& rows, Eigen::Index unknowns, double unreachable);
  void settle(std::unique_ptr<run_rows::ChainEliminator> chain, const run_rows::ChainEliminator::Rotated& right, double unreachable);
  std::unique_ptr<run_rows::ChainEliminator> eliminate;
  run_rows::ChainEliminator::Rotated rotated_links(const RunResidual& run, const std::vector<Eigen::MatrixXd>& reached, Eigen::Index columns) const;
  run_rows::ChainEliminator::Rotated rotated_whole(const RunResidual& run, std::vector<Eigen::MatrixXd> reached, Eigen::Index columns) const;
  Eigen::VectorXd released(const RunResidual& run, const Eigen::VectorXd& theta) const;
  Eigen::VectorXd linear;
  double chi2 = 0;
  bool settled = false;  // of a nonlinear model: the search for c came to rest by itself, and would again

  // Where noise of the inputs colours all readings of a run (fit/likelihood/run_input_noise.cpp). Its weights are then a filter over the whole record, not a number for each reading.
  std::shared_ptr<const InputNoise> noise;  // as the model at this theta lets it through; none where the inputs count as exact
  static const InputNoiseModel* input_noise(const RunResidual& run) { return run.shared_ ? run.shared_->input_noise.get() : nullptr; }
  static std::shared_ptr<const InputNoise> noise_through(const RunResidual& run, const Eigen::VectorXd& theta);
  static void keep_input_noise(RunResidual& run, const RunResidual& other);
  /// What `left` (samples x channels) makes most probable.
  static void settle_input_noise(RunResidual& run, const Eigen::VectorXd& theta, const Eigen::MatrixXd& left);
  /// Columns over the samples of all channels, one channel after the other, in units of the noise, white and tempered.
  Eigen::MatrixXd white(const RunResidual& run, const Eigen::MatrixXd& rows) const;
  /// The same for [minus the model's slopes in theta | other slopes | what is left], with what theta does to the filter among the slopes.
  Eigen::MatrixXd white_slopes(const RunResidual& run, const Eigen::VectorXd& theta, Eigen::MatrixXd rows) const;
  /// A sensitivity whose residual lacks the readings still.
  void whiten(const RunResidual& run, const Eigen::VectorXd& theta, Sensitivity& sensitivity) const;
  static Eigen::MatrixXd standardised(const RunResidual& run, const Eigen::VectorXd& theta, const Eigen::MatrixXd& left);

  // Where a force wanders (fit/likelihood/run_wandering.cpp): readings and model as innovations of its filter.
  std::shared_ptr<const WanderingForce> wandering;  // none where none does, or where the model is nonlinear
  /// The filter at theta of a system whose outputs have passed those of the noise; changes `step`.
  static std::shared_ptr<const WanderingForce> wander(const RunResidual& run, const Eigen::VectorXd& theta, const LinearSystem& system, ExactStep& step, Partials partials);
  static bool wanders(const RunResidual& run);
  /// The readings that the rows stand for.
  const Eigen::MatrixXd& readings(const RunResidual& run) const;
  /// What c does by its offsets to some samples of a channel: a column for each offset, or, without a filter, for the channel's own.
  Eigen::MatrixXd offset_columns(Eigen::Index channel, const Interval& samples) const;
  /// The first offset that they belong to.
  Eigen::Index offsets_from(const RunResidual& run, Eigen::Index channel) const { return run.first_offset_ + (wandering ? 0 : channel); }
  /// What a linear model makes of an initial state and a motion: samples x channels, without offsets.
  static Eigen::MatrixXd response(const RunResidual& run, const LinearSystem& system, const ExactStep& step, const Eigen::VectorXd& linear, const Motion& motion);
  /// Innovations `at` some c, samples x channels.
  Eigen::MatrixXd innovations(const RunResidual& run, const Eigen::VectorXd& at) const;
  static void settle_wandering(RunResidual& run, const Eigen::VectorXd& theta);
  static void keep_white(RunResidual& run, const RunResidual& other);
  /// Of responses that are the run's own, the noise that they count in.
  static std::shared_ptr<SharedResponses> only_noise_of(const RunResidual& run);

  /// Solves the rows [c | right] of the whole record for c. `tangents`: d y / d state at its start, per channel; `start`: d state / d c there.
  void settle_white(const RunResidual& run, const Eigen::MatrixXd& start, std::vector<Eigen::MatrixXd> tangents, const Eigen::MatrixXd& right);
};

}  // namespace unrig
