#pragma once
#include <Eigen/Core>
#include <string>
#include <vector>

#include "core/model/aeroelastic_model.h"
#include "fit/solver/least_squares.h"
#include "fit/likelihood/run_residual.h"

namespace unrig {

/// An unknown of a joint fit: a model parameter, shared or of one run.
struct Unknown {
  Eigen::Index parameter = 0;  ///< index into AeroelasticModel::parameters
  int run = -1;                ///< -1: shared by all runs
  double value = 0;
  bool held = false;
  std::string why_held;  ///< for the person who reads the report
};

/// What is known of unknown `index` beside the runs: (value - start) / known_to.
ResidualTerm what_is_known(std::size_t index, const Parameter& parameter);

/// Holds unknown `index` weakly near its present value, while the data determine only some of them.
ResidualTerm weak_prior(std::size_t index, const LeastSquaresUnknown& unknown);

/// Several runs of one rig, and the unknowns they share. Runs that are set aside (RunResidual::set_aside) have no part in chi-square.
class JointProblem {
 public:
  /// Unknowns at the model's start values: every shared parameter, and per run those that can act in it.
  JointProblem(const AeroelasticModel& model, std::vector<RunResidual> runs);

  const AeroelasticModel& model() const { return *model_; }
  std::vector<RunResidual>& runs() { return runs_; }
  const std::vector<RunResidual>& runs() const { return runs_; }
  std::vector<Unknown>& unknowns() { return unknowns_; }
  const std::vector<Unknown>& unknowns() const { return unknowns_; }
  const Parameter& parameter(const Unknown& unknown) const { return model_->parameters()[static_cast<std::size_t>(unknown.parameter)]; }

  /// The same with some of its runs, at the present values.
  JointProblem part(const std::vector<std::size_t>& runs) const;

  /// The model's theta for one run.
  Eigen::VectorXd theta(std::size_t run) const;

  struct SolveOptions {
    bool prior = false;   ///< hold unknowns weakly near their present values, while a short window determines only some of them
    int iterations = 30;
    double tolerance = 1e-7;  ///< the search ends when the next step promises to lower chi-square by less than this fraction of it
    double precision = 0.01;  ///< and when it is shorter than this many standard errors
    bool restarts = false;    ///< where it does not arrive, try other ways (LeastSquaresOptions::Effort::until_arrived)
    int most_evaluations = 400;
    double enough = 0;        ///< reduced chi-square with which the search ends wherever it stands
    Goal goal = {};           ///< beyond whose reach it ends
    std::vector<ResidualTerm> beside = {};  ///< the runs
  };
  struct Summary {
    bool converged = false;
    double chi2 = 0;
    int evaluations = 0;
    std::string message;
    bool out_of_reach = false;  ///< of the goal
  };
  /// solve_least_squares over all unknowns that are not held.
  Summary solve(const SolveOptions& options);

  /// The same as a plain least-squares problem at the present values, for `covariance` and `profile`. It looks at this object, which must outlive it
  /// unchanged.
  LeastSquaresProblem least_squares() const;

  /// "normal_force_slope (step_a.csv)": a parameter, and the run it belongs to.
  std::string name(const Unknown& unknown) const;

  /// Residual and Jacobian of all runs at the present values, one column per unknown (held ones too); behind them of what is known of parameters.
  struct Linearisation {
    Eigen::VectorXd residual;
    Eigen::MatrixXd jacobian;
    std::vector<double> run_chi2;
    double beside_runs = 0;               ///< the part of chi-square that is no run's
    Eigen::Index beside_runs_rows = 0;    ///< its rows, the last
    double chi2() const;
  };
  Linearisation linearise() const;

  /// chi-square at the present values, and its part that is no run's: what is known of parameters (Parameter::known_to).
  double chi2() const;
  double beside_runs() const;

 private:
  const AeroelasticModel* model_;
  std::vector<RunResidual> runs_;
  std::vector<Unknown> unknowns_;
};

}  // namespace unrig
