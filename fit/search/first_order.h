#pragma once
#include <cmath>
#include <Eigen/Core>
#include <string>
#include <vector>

#include "fit/likelihood/joint_problem.h"
#include "fit/likelihood/run_first_order.h"

namespace unrig {

/// The combination x of columns that leaves least of r, and |r - columns x|^2; columns that others can do without are left at 0.
struct LinearStep {
  Eigen::VectorXd x;
  double left = 0;
};
LinearStep linear_step(const Eigen::MatrixXd& columns, const Eigen::VectorXd& r);

/// A joint fit to first order about where it stands, against which laws that are not at work in it are held: their forces on its own trajectories, sent through the rig onto what is left of the readings.
class FirstOrder {
 public:
  /// Looks at `joint` as long as it lives.
  explicit FirstOrder(const JointProblem& joint);
  /// Not of a fit in which a force wanders or the model runs away, but for runs that are set aside.
  bool known() const;
  /// Chi-square that one linear step in the fit's own unknowns leaves.
  double left() const { return left_; }

  struct Promise {
    double left = INFINITY;       ///< chi-square that one linear step in all unknowns leaves, those of `with` included; infinite where a model runs away
    double largest_argument = 0;  ///< that the laws' first arguments reach
  };
  /// `with`: the same runs with effect `id` beside, with the shape that it stands at and a size (its first parameter, or where the states of a tone begin) that is next to nothing.
  Promise promise(const JointProblem& with, const std::string& id) const;

 private:
  using Beside = RunResidual::FirstOrder::Beside;
  std::vector<Beside> beside(const JointProblem& with, const std::string& id, const std::vector<Eigen::Index>& own, const std::vector<Eigen::VectorXd>& begins) const;
  LinearStep step(const std::vector<Unknown>& of_effect, const std::vector<Eigen::Index>& own, const std::vector<Beside>& rows) const;
  Eigen::Index further_states(std::size_t run, const std::vector<Eigen::Index>& own, const Beside& rows) const;

  const JointProblem& joint_;
  std::vector<RunResidual::FirstOrder> runs_;
  double left_ = 0;
};

}  // namespace unrig
