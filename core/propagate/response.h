#pragma once
#include <Eigen/Core>
#include <vector>

#include "core/propagate/exact_step.h"

namespace unrig {

/// Outputs of a linear system over consecutive samples, with partials in theta, and the state behind the last of them.
struct Response {
  Eigen::MatrixXd output;               ///< samples x channels
  std::vector<Eigen::MatrixXd> partial; ///< per parameter; empty where it does not act
  DualMatrix end;                       ///< state one step after the last sample, n x 1
};

/// Which partials to carry along: all of the system's, or none (a third of the cost).
enum class Partials { none, all };

/// m^exponent by repeated squaring, exponent 0 or more: of square matrices, with or without partials.
template <class Matrix>
Matrix power(Matrix m, Eigen::Index exponent);

/// The free response of one system from any start: no jerk, no inputs. Cost per sample 2 n (K + n/32) (1 + 2 P) for n states, K channels, P parameters:
/// outputs come in blocks from the state at the block's first sample.
class FreeResponse {
 public:
  static constexpr Eigen::Index block_length = 32;

  FreeResponse(const LinearSystem& system, const ExactStep& step, Partials partials);
  Response from(const DualMatrix& start, Eigen::Index samples) const;

  Eigen::Index channels() const { return channels_; }
  DualMatrix block(Eigen::Index channel) const;           ///< rows C transition^k of a block: block_length x n
  const DualMatrix& leap() const { return leap_; }        ///< transition^block_length

 private:
  Response empty(Eigen::Index samples) const;

  DualMatrix transition_, leap_;
  DualMatrix observe_;  ///< the channels' blocks in turn
  std::vector<bool> acts_;
  Eigen::Index channels_;
};

/// One such response.
Response coast(const LinearSystem& system, const ExactStep& step, const DualMatrix& start, Eigen::Index samples, Partials partials);

/// Driven response: `jerk` one value per sample (empty: none), `input` samples + 1 rows of inputs (empty: none). Exact for cubic-spline
/// motion and inputs that are linear between samples or cubic splines (exact_step); one n x n product per sample and parameter. Throws std::invalid_argument where the system has another number of inputs.
Response drive(const LinearSystem& system, const ExactStep& step, const DualMatrix& start, Eigen::Index samples, const Eigen::VectorXd& jerk,
               const Eigen::MatrixXd& input, Partials partials);

/// Rows y_k = C transition^k of the free response for every channel: K blocks of `samples` rows, n columns.
std::vector<Eigen::MatrixXd> free_response_rows(const LinearSystem& system, const ExactStep& step, Eigen::Index samples);

/// States that follow a unit cubic B-spline starting at sample 0, at samples 0..samples-1: n x samples.
Eigen::MatrixXd spline_states(const ExactStep& step, Eigen::Index samples);

/// A shaft that has come to rest stands exactly still at `angle` (one per column of states): the rounding of its acceleration, eps/dt^3 of a
/// spline, would turn it on with the square of the time. `motion` is the row of the angle; rate and acceleration follow it.
void stand_still(Eigen::MatrixXd& states, Eigen::Index motion, const Eigen::RowVectorXd& angle);

}  // namespace unrig
