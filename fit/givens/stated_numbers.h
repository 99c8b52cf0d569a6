#pragma once
#include <Eigen/Core>
#include <string>
#include <vector>

#include "core/rig/givens.h"
#include "fit/search/arrival.h"
#include "fit/fit.h"
#include "fit/likelihood/run_residual.h"

namespace unrig {

/// The numbers of a rig file and of the heads of runs that state their uncertainty, as independent standard normal deviations z: how many of their standard deviations they are off.
///
/// The rig's deviations come first. Those of the runs that a campaign shares stand once, whichever runs say so.
class StatedNumbers {
 public:
  StatedNumbers(const Rig& rig, const std::vector<Run>& runs);

  Eigen::Index deviations() const { return deviations_; }
  /// Rig and run with their numbers off by these. Throw std::invalid_argument where no rig is such (core/rig/givens.h).
  Rig rig_at(const Eigen::VectorXd& z) const;
  Run run_at(std::size_t run, const Eigen::VectorXd& z) const;
  /// The run's speed and density, without its readings, and the errors of what its head states.
  Run head_at(std::size_t run, const Eigen::VectorXd& z) const;
  Eigen::VectorXd errors_of_run(std::size_t run, const Eigen::VectorXd& z) const;
  const Run& stated_run(std::size_t run) const { return (*runs_)[run]; }
  /// Whether the deviation is in anything that the run depends on.
  bool acts(std::size_t run, Eigen::Index deviation) const;

  /// All numbers as stated, the rig's first, and their errors per deviation: numbers x deviations.
  const std::vector<FittedGiven>& numbers() const { return numbers_; }
  const Eigen::MatrixXd& spread() const { return spread_; }
  /// What each deviation belongs to: "normal.mass".
  const std::vector<std::string>& groups() const { return groups_; }

 private:
  const Rig* rig_;
  const std::vector<Run>* runs_;
  Eigen::Index deviations_ = 0, of_rig_ = 0;
  Eigen::MatrixXd spread_;
  std::vector<Eigen::Index> first_number_;  ///< of each run
  std::vector<FittedGiven> numbers_;
  std::vector<std::string> groups_;
};

/// Whether anything of the rig or of the runs states its uncertainty.
bool states_errors(const Rig& rig, const std::vector<Run>& runs);

/// How residuals and offsets of a joint fit move with the deviations, everything linear following.
struct NumberSlopes {
  std::vector<RunResidual::Sensitivity> runs;  ///< slopes over the model's parameters, and behind them over the deviations
  Eigen::MatrixXd offset;                      ///< runs x deviations: d offset of the first channel, as if its conversion into a load stayed what it is
};

/// At the present values of the fit, which stands at z. The deviations are parameters of each run's linear system, with slopes from central differences of its matrices, and are followed along the record
/// as the model's own are: Kaufman's rule for what is linear, like theirs. (Differences of residuals keep the rule's other term, which looks like information on numbers that only noise tells.)
/// Effects at work move with the numbers too, but for what a law looks at.
NumberSlopes number_slopes(const Arrival& at, const StatedNumbers& numbers, const Eigen::VectorXd& z);

}  // namespace unrig
