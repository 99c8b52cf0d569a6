#include "fit/solver/trust_region.h"

#include <ceres/ceres.h>
#include <glog/logging.h>

#include <algorithm>
#include <cmath>
#include <mutex>
#include <vector>

#include "fit/solver/gauss_newton.h"

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

/// The search's own variables u for the unknowns that are not held: x = scale u, or x = x0 exp(u).
class Variables {
 public:
  Variables(const LeastSquaresProblem& problem, const LeastSquaresPoint& start, bool logarithms) : start_(start.values) {
    for (std::size_t i = 0; i < problem.unknowns.size(); ++i) {
      const LeastSquaresUnknown& unknown = problem.unknowns[i];
      if (unknown.held) continue;
      const auto j = static_cast<Index>(i);
      const double x = start_[j], response = start.jacobian.col(j).norm();
      Variable v{j, unknown.lower, unknown.upper, 1, logarithms && x != 0};
      if (unknown.scale > 0) v.scale = unknown.scale;
      else if (x != 0) v.scale = std::abs(x);
      else if (response > 0 && start.residual.norm() > 0) v.scale = start.residual.norm() / response;
      list_.push_back(v);
    }
  }

  std::size_t size() const { return list_.size(); }

  VectorXd first() const {
    VectorXd u(static_cast<Index>(size()));
    for (std::size_t a = 0; a < size(); ++a) u[static_cast<Index>(a)] = list_[a].logarithm ? 0 : start_[list_[a].index] / list_[a].scale;
    return u;
  }

  VectorXd values(const double* u) const {
    VectorXd x = start_;
    for (std::size_t a = 0; a < size(); ++a) {
      const Variable& v = list_[a];
      x[v.index] = std::clamp(v.logarithm ? start_[v.index] * std::exp(u[a]) : v.scale * u[a], v.lower, v.upper);
    }
    return x;
  }

  /// d x / d u, which is diagonal.
  double slope(std::size_t a, const VectorXd& x) const { return list_[a].logarithm ? x[list_[a].index] : list_[a].scale; }
  Index index(std::size_t a) const { return list_[a].index; }

  void set_bounds(ceres::Problem& problem, double* u) const {
    for (std::size_t a = 0; a < size(); ++a) {
      const Variable& v = list_[a];
      double lower = v.lower / v.scale, upper = v.upper / v.scale;
      if (v.logarithm) {
        const double x = start_[v.index];
        lower = log_bound(v.lower, x), upper = log_bound(v.upper, x);
        if (x < 0) std::swap(lower, upper);
        if (std::isnan(lower)) lower = -std::numeric_limits<double>::infinity();
        if (std::isnan(upper)) upper = std::numeric_limits<double>::infinity();
      }
      if (std::isfinite(lower)) problem.SetParameterLowerBound(u, static_cast<int>(a), std::min(lower, u[a]));
      if (std::isfinite(upper)) problem.SetParameterUpperBound(u, static_cast<int>(a), std::max(upper, u[a]));
    }
  }

 private:
  struct Variable {
    Index index;
    double lower, upper;
    double scale;
    bool logarithm;
  };
  static double log_bound(double bound, double x) { return bound / x > 0 && std::isfinite(bound) ? std::log(bound / x) : std::nan(""); }

  VectorXd start_;
  std::vector<Variable> list_;
};

/// The whole problem as one of Ceres' cost functions. Keeps the point whose Jacobian was last asked for: the one the search stands on.
class Cost : public ceres::CostFunction {
 public:
  Cost(const LeastSquaresProblem& problem, const Variables& variables, const LeastSquaresPoint& start)
      : problem_(problem), variables_(variables), trial_(start), present_(start) {
    set_num_residuals(static_cast<int>(start.residual.size()));
    mutable_parameter_block_sizes()->push_back(static_cast<int>(variables.size()));
  }

  bool Evaluate(double const* const* u, double* residuals, double** jacobians) const override {
    const VectorXd x = variables_.values(u[0]);
    const bool derivatives = jacobians != nullptr && jacobians[0] != nullptr;
    // A shifted target needs the residual itself, which terms need not give without derivatives.
    if (x != trial_.values) trial_ = derivatives || shift_.size() > 0 ? with_derivatives(x) : try_values(problem_, x);
    else if (derivatives && trial_.jacobian.size() == 0 && trial_.finite) trial_ = with_derivatives(x);
    if (!trial_.finite) return false;  // the solver takes a shorter step
    Eigen::Map<VectorXd>(residuals, num_residuals()) = trial_.residual;
    if (shift_.size() > 0) Eigen::Map<VectorXd>(residuals, num_residuals()) -= shift_;
    if (!derivatives) return true;
    Eigen::Map<Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>> jacobian(jacobians[0], num_residuals(),
                                                                                              static_cast<Index>(variables_.size()));
    for (std::size_t a = 0; a < variables_.size(); ++a)
      jacobian.col(static_cast<Index>(a)) = trial_.jacobian.col(variables_.index(a)) * variables_.slope(a, x);
    if (!jacobian.allFinite()) return false;
    present_ = trial_;
    return true;
  }

  void shift(const VectorXd& residual) { shift_ = residual; }
  const LeastSquaresPoint& present() const { return present_; }
  /// The point at u, where the search may have gone back to.
  LeastSquaresPoint at(const VectorXd& u) const {
    const VectorXd x = variables_.values(u.data());
    return x == present_.values ? present_ : with_derivatives(x);
  }
  int evaluations() const { return evaluations_; }

 private:
  LeastSquaresPoint with_derivatives(const VectorXd& x) const {
    ++evaluations_;
    return linearise(problem_, x);
  }

  const LeastSquaresProblem& problem_;
  const Variables& variables_;
  VectorXd shift_;
  mutable LeastSquaresPoint trial_, present_;
  mutable int evaluations_ = 0;
};

/// Ends the search where chi-square is low enough, its goal is out of reach, or the Gauss-Newton step left is short: the step that would only confirm it is saved.
class EnoughIsEnough : public ceres::IterationCallback {
 public:
  EnoughIsEnough(const LeastSquaresProblem& problem, const Cost& cost, const SearchLimits& limits) : problem_(problem), cost_(cost), limits_(limits) {}
  ceres::CallbackReturnType operator()(const ceres::IterationSummary& iteration) override {
    if (iteration.iteration > 0 && !iteration.step_is_successful) return ceres::SOLVER_CONTINUE;
    const LeastSquaresPoint& point = cost_.present();
    if (point.chi2() < limits_.enough) return ceres::SOLVER_TERMINATE_SUCCESSFULLY;
    const double promised = gauss_newton(problem_, point).promised;
    const bool is_near = promised <= limits_.precision * limits_.precision * variance_factor(problem_, point.chi2());
    return is_near || limits_.goal.is_out_of_reach(point.chi2(), promised) ? ceres::SOLVER_TERMINATE_SUCCESSFULLY : ceres::SOLVER_CONTINUE;
  }

 private:
  const LeastSquaresProblem& problem_;
  const Cost& cost_;
  const SearchLimits& limits_;
};

/// A search that ends where the model has no slopes is an outcome. Ceres logs it as an error, silent or not; a program that has a log of its own keeps it.
void say_nothing() {
  static std::once_flag once;
  std::call_once(once, [] {
    if (!google::IsGoogleLoggingInitialized()) FLAGS_minloglevel = google::GLOG_FATAL;
  });
}

}  // namespace

SearchOutcome search(const LeastSquaresProblem& problem, const LeastSquaresPoint& start, const SearchStrategy& strategy, const SearchLimits& limits) {
  SearchOutcome outcome{start, 0, 0};
  const Variables variables(problem, start, strategy.logarithms);
  if (variables.size() == 0 || !start.finite) return outcome;

  Cost cost(problem, variables, start);
  VectorXd u = variables.first();
  ceres::Problem::Options keep;
  keep.cost_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  ceres::Problem ceres_problem(keep);
  ceres_problem.AddResidualBlock(&cost, nullptr, u.data());
  variables.set_bounds(ceres_problem, u.data());

  ceres::Solver::Options options;
  options.linear_solver_type = ceres::DENSE_QR;
  options.trust_region_strategy_type = strategy.dogleg ? ceres::DOGLEG : ceres::LEVENBERG_MARQUARDT;
  options.use_nonmonotonic_steps = strategy.nonmonotonic;
  options.jacobi_scaling = strategy.column_scaling;
  options.initial_trust_region_radius = strategy.first_radius;
  options.max_num_line_search_step_size_iterations = 0;  // a step beyond a bound is cut off at it; searching along the bounds costs more than it gains
  options.max_num_consecutive_invalid_steps = 100;  // not the end: the trust region shrinks until the model answers
  options.gradient_tolerance = 0;  // has the unit of the unknowns
  options.parameter_tolerance = 1e-16;
  options.logging_type = ceres::SILENT;
  const auto run = [&](int iterations, double relative_change) {
    options.max_num_iterations = iterations;
    options.function_tolerance = relative_change;
    ceres::Solver::Summary summary;
    ceres::Solve(options, &ceres_problem, &summary);
    outcome.iterations += static_cast<int>(summary.iterations.size()) - 1;
  };
  say_nothing();
  constexpr int homotopy_iterations = 10;
  constexpr double homotopy_change = 1e-3;
  for (int step = 1; step < strategy.homotopy_steps; ++step) {
    cost.shift(start.residual * (1 - static_cast<double>(step) / strategy.homotopy_steps));
    run(homotopy_iterations, homotopy_change);
  }
  cost.shift({});
  EnoughIsEnough enough(problem, cost, limits);
  options.callbacks.push_back(&enough);
  run(limits.iterations, limits.relative_change);
  outcome.point = cost.at(u);
  outcome.evaluations = cost.evaluations();
  return outcome;
}

}  // namespace unrig
