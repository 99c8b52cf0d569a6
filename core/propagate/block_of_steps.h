#pragma once
#include <Eigen/Core>

#include "core/propagate/step_matrices.h"

namespace unrig {

/// Tangents of [x; f] carried over a block of L steps whose forces answer with another slope at each. From step to step only what the laws see and the channels read is
/// followed, by the responses to the block's beginning and to each change within it:
///
///   seen_k = H S^k [dx_0; df_0] + sum_{j < k} H S^(k-1-j) P [df_j; djerk_j],   [dx_L; 0] = S^L [dx_0; df_0] + sum_{j < L} S^(L-1-j) P [df_j; djerk_j],
///
/// df_j the forces in the middle and at the end of step j, S one step without these, P what they and the jerk add behind it, H the rows that see and read. That is the recursion
/// x_{k+1} = S x_k + P f_k written out, for some 3 n + 3 L m products a step and direction instead of n^2.
///
/// A direction is a row, and rows are padded (padded_rows). `Work` is what one block works on.
class BlockOfSteps {
 public:
  struct Work {
    Eigen::MatrixXd changes;  ///< directions x [dx; df | of each step its df in the middle and at the end, its djerk]: the state where the block begins, and what changes on the way
    Eigen::MatrixXd seen;     ///< directions x (steps per_step()), of each step [arguments in its middle and at its end without the forces there | channels at its beginning]
    Eigen::MatrixXd room;
  };

  /// `jerks`: whether directions touch the jerk.
  BlockOfSteps(const StepMatrices& one, Eigen::Index steps, bool jerks);
  /// The length for which a step takes the least products.
  static Eigen::Index best_length(const StepMatrices& one);
  Work work(Eigen::Index directions) const;

  Eigen::Index steps() const { return steps_; }
  Eigen::Index per_step() const { return seen_ + channels_; }
  /// The changes of a step: df in its middle and at its end, and djerk over it.
  auto forces(Work& work, Eigen::Index k) const { return work.changes.middleCols(carried() + k * changes_, forces_); }
  auto jerk(Work& work, Eigen::Index k) const { return work.changes.col(carried() + k * changes_ + forces_); }

  /// What is seen as if nothing changed.
  void begin(Work& work) const;
  /// Adds what the changes before the end of step k do to what that step sees.
  void add_changes(Work& work, Eigen::Index k) const;
  /// The state behind the block in the place of that before it.
  void end(Work& work) const;

 private:
  Eigen::Index carried() const { return states_ + feedbacks_; }

  Eigen::Index steps_, states_, feedbacks_, forces_, seen_, channels_, changes_;
  Eigen::MatrixXd free_seen_;     // [x; f] x (steps per_step)
  Eigen::MatrixXd change_seen_;   // (steps changes) x per_step, the last step's changes last
  Eigen::MatrixXd all_end_;       // columns of Work::changes x x
  Eigen::VectorXd jerk_at_once_;  // what is seen
};

}  // namespace unrig
