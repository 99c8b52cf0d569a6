#pragma once
#include <Eigen/Core>
#include <cstddef>
#include <functional>
#include <limits>
#include <string>
#include <vector>

namespace unrig {

/// One number of a least-squares problem.
struct LeastSquaresUnknown {
  std::string name;
  double value = 0;  ///< start, or the value it is held at
  double lower = -std::numeric_limits<double>::infinity();
  double upper = std::numeric_limits<double>::infinity();
  bool held = false;
  double scale = 0;  ///< a change of it that matters, in its own unit; 0: its start value, or what moves the residual by its own length
};

/// Some residuals, each divided by its standard deviation, and the unknowns they depend on. Several terms are evaluated at the same time, in as many threads.
struct ResidualTerm {
  std::vector<std::size_t> unknowns;  ///< indices into LeastSquaresProblem::unknowns
  Eigen::Index size = 0;              ///< number of residuals
  /// values (of `unknowns`, in their order) -> residual (size) and d residual / d values (size x unknowns); both arrive as zeros. Without a
  /// jacobian (nullptr) only the length of the residual matters: a step is being tried, and the derivative is asked for next if it is good.
  /// False, or a number that is not finite: the model has no answer there, and the search takes a shorter step.
  std::function<bool(const Eigen::VectorXd& values, Eigen::VectorXd& residual, Eigen::MatrixXd* jacobian)> evaluate;
};

/// Least of chi2(x) = sum over terms |r(x)|^2, lower <= x <= upper.
struct LeastSquaresProblem {
  std::vector<LeastSquaresUnknown> unknowns;
  std::vector<ResidualTerm> terms;
  /// Of the data behind the residuals: (number of data) - (everything that was fitted). 0: residuals minus unknowns that are not held. It differs
  /// where residuals were compressed or unknowns eliminated.
  double degrees_of_freedom = 0;
  /// Where the residuals are in units of a noise that is known: a standard error is not taken for less than that noise makes it, however small they are. Otherwise 0.
  double least_variance = 0;

  Eigen::VectorXd values() const;
  Eigen::Index residuals() const;
};

/// A problem near some values of its unknowns: r(x + dx) = residual + jacobian dx.
struct LeastSquaresPoint {
  Eigen::VectorXd values;
  Eigen::VectorXd residual;
  Eigen::MatrixXd jacobian;  ///< one column per unknown; zero for those held during a search
  bool finite = false;
  double chi2() const { return residual.squaredNorm(); }
};

/// At `values`, with the columns of held unknowns. `finite` is false where the model has no answer there.
LeastSquaresPoint linearise(const LeastSquaresProblem& problem, const Eigen::VectorXd& values);
/// Without derivatives.
LeastSquaresPoint try_values(const LeastSquaresProblem& problem, const Eigen::VectorXd& values);

/// Variance factor chi2 / degrees of freedom; 1 where there are none.
double variance_factor(const LeastSquaresProblem& problem, double chi2);

/// A chi-square that a search is to get to, or it is of no use: it ends where its next step promises less than `share` of the way there.
struct Goal {
  double chi2 = std::numeric_limits<double>::infinity();
  double share = 0;
  bool is_out_of_reach(double now, double promised) const { return promised < share * (now - chi2); }
};

struct LeastSquaresOptions {
  int iterations = 400;           ///< of one attempt
  int evaluations = 20000;        ///< of all attempts together
  double relative_change = 1e-9;  ///< of chi2 in one step, below which the trust-region search hands over to the final Gauss-Newton steps
  /// The search ends when the Gauss-Newton step left is shorter than this many standard errors. 0: when no digit moves any more. Above 1e-3 it
  /// is also what counts as arrived.
  double precision = 1e-4;
  enum class Effort {
    once,           ///< one attempt, arrived or not
    until_arrived,  ///< where that does not arrive, others, until two agree on the least chi2 or only one is found
    exhaustive      ///< all of them: the least of all minima found
  };
  Effort effort = Effort::until_arrived;
  double enough = 0;  ///< chi2 with which an attempt ends, as arrived, wherever it stands: where slopes mislead near the least
  Goal goal = {};     ///< beyond whose reach an attempt ends, not arrived
};

struct LeastSquaresResult {
  struct Attempt {
    std::string strategy;
    bool arrived = false;
    double chi2 = 0;      ///< NaN where no finite residual was found
    int evaluations = 0;  ///< of the model with its derivatives
  };
  LeastSquaresPoint point;  ///< the best found
  bool arrived = false;
  double step_left = 0;  ///< length of the Gauss-Newton step left, in standard errors: the relative offset
  int evaluations = 0;
  bool out_of_reach = false;  ///< of LeastSquaresOptions::goal, where the best attempt ended
  std::vector<Attempt> attempts;
  std::string message;  ///< for people: what was needed, or what is in the way, by the names of the unknowns

  double chi2() const { return point.chi2(); }
};

/// Levenberg-Marquardt with dense QR (Ceres), then Gauss-Newton steps by QR on the unknowns that are not pressed against a bound, until the step
/// left is shorter than `precision`.
///
/// Arrived means: the relative offset sqrt(chi2 reduction the linearised model still promises / variance factor) is below 1e-3 (D. M. Bates and
/// D. G. Watts, Technometrics 23 (1981) 179, who take it per parameter), or the step is lost in rounding; and the residuals still respond to as
/// many directions of the unknowns as at the start. A search that ran off to where they no longer respond (exp(-large)) has not arrived, however
/// small its gradient.
///
/// Where the first attempt has not arrived, the same problem is tried from the same start with: a cautious first trust region, dogleg steps, the
/// logarithms of the unknowns, nonmonotonic steps, a target led from the model's own prediction to the data (Newton homotopy), no column scaling,
/// and from starts spread around the given one (Halton sequence: the same every time).
///
/// Never throws for want of convergence: `arrived` is false and `message` names what is in the way. Throws std::invalid_argument where a term
/// names an unknown that does not exist or a start value is not finite; starts outside the bounds are moved to them.
LeastSquaresResult solve_least_squares(const LeastSquaresProblem& problem, const LeastSquaresOptions& options = {});

/// Sets the values of the unknowns.
void take(const LeastSquaresPoint& point, LeastSquaresProblem& problem);

}  // namespace unrig
