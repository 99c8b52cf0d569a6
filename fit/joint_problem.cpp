#include "fit/joint_problem.h"

#include <ceres/ceres.h>

#include <algorithm>
#include <cmath>
#include <memory>

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Ceres' view of one run: its unknowns in, its P + 1 compressed residuals out.
class RunCost : public ceres::CostFunction {
 public:
  RunCost(const RunResidual& run, VectorXd theta, std::vector<Index> parameters) : run_(run), theta_(std::move(theta)), parameters_(std::move(parameters)) {
    set_num_residuals(static_cast<int>(theta_.size()) + 1);
    for (std::size_t i = 0; i < parameters_.size(); ++i) mutable_parameter_block_sizes()->push_back(1);
  }

  bool Evaluate(double const* const* values, double* residuals, double** jacobians) const override {
    VectorXd theta = theta_;
    for (std::size_t i = 0; i < parameters_.size(); ++i) theta[parameters_[i]] = *values[i];
    if (last_.theta.size() == 0 || last_.theta != theta) last_ = run_.solve(theta);
    if (!std::isfinite(last_.chi2)) return false;  // an unstable model: the solver takes a shorter step
    if (!jacobians) {
      Eigen::Map<VectorXd> residual(residuals, num_residuals());
      residual.setZero();
      residual[num_residuals() - 1] = std::sqrt(last_.chi2);
      return true;
    }
    const RunResidual::Evaluation e = run_.differentiate(last_);
    Eigen::Map<VectorXd>(residuals, num_residuals()) = e.residual;
    if (jacobians)
      for (std::size_t i = 0; i < parameters_.size(); ++i)
        if (jacobians[i]) Eigen::Map<VectorXd>(jacobians[i], num_residuals()) = e.jacobian.col(parameters_[i]);
    return true;
  }

 private:
  const RunResidual& run_;
  VectorXd theta_;
  std::vector<Index> parameters_;
  mutable RunResidual::Solution last_;  ///< the solver asks for the value first and for the derivative where the value was good
};

/// (value - centre) / width.
class PriorCost : public ceres::SizedCostFunction<1, 1> {
 public:
  PriorCost(double centre, double width) : centre_(centre), width_(width) {}
  bool Evaluate(double const* const* values, double* residuals, double** jacobians) const override {
    residuals[0] = (values[0][0] - centre_) / width_;
    if (jacobians && jacobians[0]) jacobians[0][0] = 1 / width_;
    return true;
  }

 private:
  double centre_, width_;
};

/// How far a first guess may reasonably be off: half of itself, or a twentieth for ratios that start near zero.
double prior_width(double value) { return std::max(0.5 * std::abs(value), 0.05); }

}  // namespace

JointProblem::JointProblem(const AeroelasticModel& model, std::vector<RunResidual> runs) : model_(&model), runs_(std::move(runs)) {
  const auto& parameters = model.parameters();
  for (std::size_t j = 0; j < parameters.size(); ++j)
    if (!parameters[j].per_run) unknowns_.push_back({static_cast<Index>(j), -1, parameters[j].start, false, {}});
  for (std::size_t r = 0; r < runs_.size(); ++r)
    for (std::size_t j = 0; j < parameters.size(); ++j)
      if (parameters[j].per_run && runs_[r].conditions().speed > 0) unknowns_.push_back({static_cast<Index>(j), static_cast<int>(r), parameters[j].start, false, {}});
}

VectorXd JointProblem::theta(std::size_t run) const {
  VectorXd theta = model_->start_values();
  for (const Unknown& u : unknowns_)
    if (u.run < 0 || u.run == static_cast<int>(run)) theta[u.parameter] = u.value;
  return theta;
}

JointProblem::Summary JointProblem::solve(const SolveOptions& options) {
  ceres::Problem problem;
  for (Unknown& u : unknowns_) {
    problem.AddParameterBlock(&u.value, 1);
    const Parameter& p = parameter(u);
    problem.SetParameterLowerBound(&u.value, 0, p.lower);
    problem.SetParameterUpperBound(&u.value, 0, p.upper);
    u.value = std::clamp(u.value, p.lower, p.upper);
    if (u.held) problem.SetParameterBlockConstant(&u.value);
    if (options.prior && !u.held) problem.AddResidualBlock(new PriorCost(u.value, prior_width(u.value)), nullptr, &u.value);
  }
  for (std::size_t r = 0; r < runs_.size(); ++r) {
    std::vector<Index> parameters;
    std::vector<double*> blocks;
    for (Unknown& u : unknowns_) {
      if (u.run >= 0 && u.run != static_cast<int>(r)) continue;
      parameters.push_back(u.parameter);
      blocks.push_back(&u.value);
    }
    problem.AddResidualBlock(new RunCost(runs_[r], model_->start_values(), parameters), nullptr, blocks);
  }
  ceres::Solver::Options solver;
  solver.linear_solver_type = ceres::DENSE_QR;
  solver.max_num_iterations = options.iterations;
  solver.function_tolerance = options.tolerance;
  solver.parameter_tolerance = 1e-10;
  solver.gradient_tolerance = 1e-14;
  solver.logging_type = ceres::SILENT;
  ceres::Solver::Summary report;
  ceres::Solve(solver, &problem, &report);
  Summary summary;
  summary.converged = report.termination_type == ceres::CONVERGENCE;
  summary.chi2 = 2 * report.final_cost;
  summary.evaluations = std::max(0, report.num_jacobian_evaluations);  // -1 where nothing was free
  summary.message = report.message;
  return summary;
}

double JointProblem::Linearisation::chi2() const {
  double sum = 0;
  for (double x : run_chi2) sum += x;
  return sum;
}

JointProblem::Linearisation JointProblem::linearise() const {
  const auto count = static_cast<Index>(unknowns_.size()), rows = static_cast<Index>(model_->parameters().size()) + 1;
  Linearisation lin;
  lin.residual.resize(rows * static_cast<Index>(runs_.size()));
  lin.jacobian = MatrixXd::Zero(lin.residual.size(), count);
  for (std::size_t r = 0; r < runs_.size(); ++r) {
    const RunResidual::Evaluation e = runs_[r].evaluate(theta(r), Partials::all);
    const Index first = rows * static_cast<Index>(r);
    lin.residual.segment(first, rows) = e.residual;
    for (Index i = 0; i < count; ++i) {
      const Unknown& u = unknowns_[static_cast<std::size_t>(i)];
      if (u.run < 0 || u.run == static_cast<int>(r)) lin.jacobian.col(i).segment(first, rows) = e.jacobian.col(u.parameter);
    }
    lin.run_chi2.push_back(e.chi2);
  }
  return lin;
}

double JointProblem::chi2() const {
  double sum = 0;
  for (std::size_t r = 0; r < runs_.size(); ++r) sum += runs_[r].evaluate(theta(r), Partials::none).chi2;
  return sum;
}

}  // namespace unrig
