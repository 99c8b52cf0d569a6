#pragma once
#include <Eigen/Core>
#include <deque>
#include <optional>
#include <vector>

#include "core/model/aeroelastic_model.h"
#include "core/run/run.h"
#include "correct/segments/knots.h"
#include "correct/estimate/prior.h"
#include "correct/estimate/uncertainty_budget.h"
#include "fit/likelihood/run_residual.h"

namespace unrig {

/// A run in which the shaft moves and rests by turns, cut into legs at rests: its cost goes with the number of its motions, that of all their knots together with its square and more.
///
/// Given theta, each leg hands on the state in which it leaves rig and section, and the next one goes on from there:
///
///   chi^2(theta) = sum_p min_(c_p) |W_p (y_p - y(theta, c_p, x_p(theta)))|^2 + min_w |A w - b(theta)|^2,   x_(p+1) = x behind leg p at theta and the best c_p,
///
/// and x_p with its derivatives in theta, c_p following as far as Kaufman's rule knows. A leg has knots of its own motions, and finds offsets o_p and a level a_p of the angle of its own. The last term says that they are the same in all legs, w = (o, a):
/// o_p - g (a_p - p_p) = o - g a within the errors of its left side, with p_p the shaft's position that the leg arrived in and g what a steady radian reads. A leg that arrived in a position that is a
/// little off has made up for that by its offset: its reading of the level is good all the same.
///
/// What else c_p leaves open of the state behind it is not handed on, nor is it in the band of the next leg: what vibrations and lags keep of an error within the noise is far below it at the other end of
/// a rest of some semichords. One leg is the run as it is.
class RunInLegs {
 public:
  /// Windows by legs, in samples of the run. More than one leg only for a linear model without measured inputs and signals, whose states would begin anew in each (correct.cpp sees to that).
  RunInLegs(const AeroelasticModel& model, const Run& run, const std::vector<Windows>& legs);

  /// The same legs, noise levels and priors of the motions against another model, and the run at other numbers of its head.
  RunInLegs held_against(const AeroelasticModel& model, const Run& run) const;

  /// The sum over all legs: `linear` and `model` are those of a single leg, empty for several. chi-square infinite where one has no answer.
  RunResidual::Solution solve(const Eigen::VectorXd& theta);
  /// Throws NoAnswer where several legs have no answer at that theta.
  RunResidual::Evaluation differentiate(const RunResidual::Solution& solution);
  /// The legs' own, at the theta of `solution`.
  const std::vector<RunResidual::Evaluation>& by_leg(const RunResidual::Solution& solution);
  void differentiate_only(const std::vector<Eigen::Index>& parameters);
  /// Noise of each leg from what the model at theta leaves of it, spikes left out, and the prior of its motion from then on (fit/likelihood/motion_prior.h).
  void learn_noise_and_motion(const Eigen::VectorXd& theta);
  /// The same run, in one leg and with white noise so far, with these colours of it (RunResidual::set_colours).
  RunInLegs with_colours(const Eigen::VectorXd& theta, const RunResidual::Colours& colours) const;

  std::size_t size() const { return legs_.size(); }
  const Interval& samples(std::size_t leg) const { return legs_[leg].samples; }
  RunResidual& residual(std::size_t leg) { return *legs_[leg].residual; }
  const RunResidual& residual(std::size_t leg) const { return *legs_[leg].residual; }
  /// Readings and rows of the motions' priors, which count in chi-square too, less what is linear and unknown.
  Eigen::Index degrees_of_freedom() const;

  /// What is the same for the budgets of all legs, at the last evaluation with derivatives in all of theta.
  struct Together {
    RunResidual::Evaluation all;
    std::vector<ThetaKnown> known;               ///< by leg, and behind them what ties them to each other
    std::vector<Eigen::VectorXd> answer_to_reading;  ///< by leg
  };
  Together look_at(const RunResidual::Solution& solution, const Prior& prior, bool with_calibration);
  /// How uncertain theta and c of a leg are (correct/estimate/uncertainty_budget.h). Noise counts `inflation` fold.
  UncertaintyBudget budget(std::size_t leg, const Together& together, const Prior& prior, double calibration_uncertainty, double inflation) const;

 private:
  /// Rows [A | b] for w; d b / d theta where the evaluations are known; and which part of each row's variance is the angle's.
  struct Ties {
    Eigen::MatrixXd rows, slope;
    Eigen::VectorXd angle_share;
  };
  Ties ties() const;
  std::vector<Eigen::VectorXd> answers_to_reading(const Together& together, const Prior& prior) const;
  struct Leg {
    Interval samples;
    Run own;  ///< its part of the run, where it is not all of it
    std::optional<RunResidual> residual;
    Eigen::MatrixXd motion_prior;
  };
  const AeroelasticModel* model_;
  std::vector<Windows> windows_;
  std::deque<Leg> legs_;
  std::vector<RunResidual::Solution> solutions_;
  std::vector<RunResidual::Evaluation> evaluations_;  ///< at the theta of the solutions; empty where they were not asked for
};

/// What a search (correct/estimate/prior.h) asks of it.
Searched searched(RunInLegs& legs);

}  // namespace unrig
