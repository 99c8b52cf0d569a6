#pragma once
#include <Eigen/Core>
#include <optional>
#include <vector>

#include "core/propagate/exact_step.h"
#include "core/run/run.h"

namespace unrig {

/// Standard deviation of the noise of a measured input, from where it is quiet; 0 where it never is, for then its noise cannot be told from it.
///
/// The record is looked at in blocks of 64 samples. It is quiet where a block varies by less than twice the quietest one (white noise scatters by a factor of 1.6 over
/// thousands of blocks), provided that the loudest varies by ten times as much. The level is that of the differences of the quiet blocks (noise_level). Missing samples are left out.
double noise_where_quiet(const Eigen::VectorXd& input);

/// Noise n of a run's inputs as white noise e of unit variance makes it: n_k = H s_k + J e_k, s_{k+1} = Phi s_k + Gamma e_k. A derived input (velocity or acceleration of the
/// mount, core/model/run_inputs.h) has the noise of the measured one as it comes out of the difference or the sum.
struct InputNoiseModel {
  Eigen::MatrixXd phi, gamma;  ///< states x states, states x sources
  Eigen::MatrixXd h, j;        ///< inputs x states, inputs x sources
  Eigen::MatrixXd start;       ///< covariance of s before the first sample
};

/// Of a run's measured inputs, in the order of LinearSystem; none where no noise of theirs is known.
std::optional<InputNoiseModel> noise_of_inputs(const Run& run, const Conditions& conditions);

/// What noise of the measured inputs does to the readings of a run. The model is driven by what was measured, so that
///
///   measured - model = own noise of the readings - response of the model to the noise of its inputs,
///
/// which is coloured like the rig itself: it rings at the resonances. The innovations of its Kalman filter are white (T. Kailath, IEEE Trans. Autom. Control 13 (1968) 646); their squares,
/// in units of their own standard deviations, sum to the chi-square of generalised least squares. The response starts from zero: what was before is in the unknown initial state.
class InputNoise {
 public:
  /// `system` without feedback, `weight` (samples x channels): one over the standard deviation of the reading's own noise, 0 for a reading that does not count.
  InputNoise(const LinearSystem& system, const ExactStep& step, const InputNoiseModel& inputs, const Eigen::MatrixXd& weight);

  /// Columns over the first samples of all channels, one channel after the other, as their innovations in units of their standard deviations: white where the column is the
  /// noise. Rows of readings that do not count are 0. A linear map, for residuals and slopes alike.
  Eigen::MatrixXd whitened(const Eigen::MatrixXd& rows) const;

  /// The most probable noise of the inputs (samples + 1 rows), from readings minus model as `whitened` gives them. Minus it, the inputs' errors.
  Eigen::MatrixXd most_probable(const Eigen::VectorXd& white) const;

  /// log det of the readings' covariance: what `whitened` takes from the logarithm of their likelihood, twice.
  double log_determinant() const { return log_determinant_; }
  /// Mean square of what the inputs' noise does to the reading of a channel.
  double variance(Eigen::Index channel) const { return variance_[channel]; }

 private:
  struct Gain {
    Eigen::MatrixXd gain;            // states x present channels
    Eigen::MatrixXd inverse_root;    // of the innovations' covariance
    std::vector<Eigen::Index> present;
  };
  InputNoiseModel inputs_;
  Eigen::MatrixXd transition_, observe_;
  struct Drive {
    Eigen::MatrixXd state, reading;  // by the sources of one sample
  } first_, later_;
  std::vector<Gain> gains_;
  std::vector<std::size_t> which_;  // gain of each sample
  double log_determinant_ = 0;
  Eigen::VectorXd variance_;
};

}  // namespace unrig
