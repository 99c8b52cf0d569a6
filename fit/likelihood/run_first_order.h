#pragma once
#include <Eigen/Core>
#include <memory>
#include <vector>

#include "core/numerics/householder.h"
#include "fit/likelihood/run_linearised.h"

namespace unrig {

/// A run about theta and the c that belongs to it, to first order: what is left of its readings and how they follow c and theta, sample by sample in units of the noise. A model with laws that this one
/// lacks is held against it: c is not searched anew for each of them, and the derivatives in what both models know are reckoned once.
class RunResidual::FirstOrder {
 public:
  /// Looks at `run` as long as it lives. Not known where its model runs away, or where a force wanders in it, behind whose filter no law is followed.
  FirstOrder(const RunResidual& run, const Eigen::VectorXd& theta);
  bool known() const { return columns_ != nullptr; }

  /// The run itself: slopes of the prediction in theta and what is left, c at its best; P rows more or less, with the inner products of all samples.
  const Eigen::MatrixXd& slopes() const { return slopes_; }
  const Eigen::VectorXd& left() const { return left_; }

  /// The same with another model at work from the same c.
  struct Beside {
    Eigen::MatrixXd slopes;  ///< rows x [P of this model | parameters asked for | states that only the other model has, where they begin unknown]
    Eigen::VectorXd left;    ///< infinite where the other model runs away
    double largest_argument = 0;  ///< that the first argument of a law reaches which only the other model has
  };
  /// `other`: the same run with the states of this model and further ones behind them. `parameters`: of its theta. `begins`: further states that begin unknown, where they do; empty: at 0.
  Beside beside(const RunResidual& other, const Eigen::VectorXd& theta, const std::vector<Eigen::Index>& parameters, const Eigen::VectorXd& begins = {}) const;

  /// c of `run` where the unknowns of the same run held against another model stand, which has further states or fewer behind those that both have: 0 for what only `other` has.
  static Eigen::VectorXd as_other_has_it(const RunResidual& run, const Eigen::VectorXd& linear, const RunResidual& other);
  /// Starts the search for c in `other` from the last one that was searched in `run`, where there is one.
  static void start(RunResidual& other, const RunResidual& run);

 private:
  Eigen::MatrixXd weighted(const Eigen::MatrixXd& rows) const;
  Eigen::MatrixXd beside_c(const Eigen::MatrixXd& rows) const;

  const RunResidual& run_;
  std::shared_ptr<const Linearised> model_;
  Eigen::VectorXd linear_;                               // c
  Eigen::VectorXd angle_left_;                           // of the rows that tell of the angle
  std::shared_ptr<const run_rows::Eliminator> columns_;  // what c does
  Householder in_theta_;                                 // what theta does beside it
  Eigen::MatrixXd slopes_;
  Eigen::VectorXd left_;
};

}  // namespace unrig
