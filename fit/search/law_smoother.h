#pragma once
#include <Eigen/Core>
#include <vector>

#include "core/model/aeroelastic_model.h"
#include "core/propagate/exact_step.h"
#include "core/propagate/feedback_force.h"
#include "fit/likelihood/run_residual.h"

namespace unrig {

/// The trajectory of a free decay under nonlinear laws that are trusted only so far:
///
///   x_{k+1} = Phi x_k + Gamma0 f(z_k) + Gamma1 f(z_{k+1}) + G w_k + inputs,   y_k = C x_k + D (f(z_k) + e_k) + offset + noise
///
/// with the least J = sum (noise / its sigma)^2 + sum (w / sigma)^2 over the first state, all w_k, the offsets and theta; e_k are the errors of laws among w_k, where a step is a sample: a channel reads them as it reads the laws. The disturbances w_k are an error of every
/// law that the channels show by itself (not of a clock, nor of a memory that only another law looks at) and an unknown acceleration of every coordinate, constant over a step: a sample, or a part of it where a law asks for small steps. The laws see the trajectory that the data ask for instead of one that was
/// followed from the start, so that an error of theirs does not grow along the record: J has no further minima as long as sigma is large, and as sigma
/// shrinks, the trajectory becomes the model's own. Noise of a colour is taken for white. Memories, on which no disturbance acts, are
/// followed along each trajectory before the laws are linearised about it. Gauss-Newton, which eliminates the states from the last sample to the first: linear in the samples.
/// Source: B. M. Bell, SIAM Journal on Optimization 4 (1994) 626, with theta as a further state.
class LawSmoother {
 public:
  /// `parameters`: those of theta that are searched. Looks at the first `most_samples` of the run, where a decay is over.
  LawSmoother(const RunResidual& run, std::vector<Eigen::Index> parameters);
  static constexpr Eigen::Index most_samples = 5000;
  static constexpr Eigen::Index most_parts = 4;  ///< of a sample, where a law asks for small steps

  Eigen::Index samples() const { return readings_; }
  Eigen::Index coordinates() const { return system_.coordinates; }

  /// Per disturbance: white ones of this r.m.s. move the channels as much as they are seen to move.
  Eigen::VectorXd enough_to_move(const Eigen::VectorXd& theta);

  /// What the run says of a change of theta near the present trajectory: the residual factor * change - right. Before there is a trajectory the laws are
  /// taken for zero.
  struct Information {
    Eigen::MatrixXd factor;
    Eigen::VectorXd right;
  };
  Information information(const Eigen::VectorXd& theta, const Eigen::VectorXd& sigma);

  /// Takes the trajectory that belongs to this change of theta.
  void step(const Eigen::VectorXd& change);

  /// J along the present trajectory, with the laws' forces of the trajectory before it.
  double cost(const Eigen::VectorXd& sigma) const;
  /// R.m.s. of each disturbance along it.
  Eigen::VectorXd disturbance() const;
  /// States of the model at its samples, n x samples.
  Eigen::MatrixXd states() const;
  /// c of the run (RunResidual) that belongs to it.
  Eigen::VectorXd linear() const;

 private:
  void prepare(const Eigen::VectorXd& theta);
  std::vector<Eigen::Index> laws_that_show() const;
  void look_at_laws(const Eigen::VectorXd& theta);
  void follow_memories(const Eigen::VectorXd& theta);
  Eigen::MatrixXd moved_by_theta() const;
  void write_step(Eigen::Index k, const Eigen::Ref<const Eigen::MatrixXd>& moved);
  void write_reading(Eigen::Index k, Eigen::Index channel, Eigen::Ref<Eigen::RowVectorXd> row) const;
  Eigen::MatrixXd read_disturbances() const;
  void answer_at(Eigen::Index k, const Eigen::VectorXd& theta);
  auto law_partials(Eigen::Index k) const { return law_partial_.middleCols(k * changes_, changes_); }
  auto answer(Eigen::Index k) const { return answer_.middleCols(k * arguments_.count(), arguments_.count()); }

  const RunResidual& run_;
  std::vector<Eigen::Index> parameters_;
  Eigen::MatrixXd measured_, weight_, inputs_;
  std::vector<Eigen::Index> free_;
  LinearSystem system_;
  ExactStep exact_;
  Eigen::Index readings_ = 0, parts_ = 1, samples_ = 0, channels_ = 0, changes_ = 0, states_ = 0, laws_ = 0, disturbances_ = 0;
  Eigen::MatrixXd gamma0_, gamma1_, disturb_;
  Arguments arguments_;
  std::vector<Eigen::Index> show_;  ///< the laws whose error the first disturbances are

  bool followed_ = false;
  Eigen::MatrixXd state_, disturbance_;         ///< n x samples, disturbances x (samples - 1)
  Eigen::MatrixXd force_, law_partial_;         ///< of the laws along it
  Eigen::MatrixXd answer_;                      ///< by how much they change with what the laws see: laws x (arguments samples)
  Eigen::VectorXd offset_;

  // Of the last linearisation: x_{k+1} over [x_k | w_k | change of theta | 1]; w_k over [w_k | x_k | change | offsets | right]; the start over [free
  // states | offsets | change | right].
  std::vector<Eigen::MatrixXd> ahead_, best_disturbance_;
  Eigen::MatrixXd first_;
};

}  // namespace unrig
