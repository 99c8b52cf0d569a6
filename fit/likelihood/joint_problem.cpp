#include "fit/likelihood/joint_problem.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <set>

#include "core/effects/effect.h"
#include "core/numerics/in_parallel.h"
#include "fit/likelihood/modal_frequencies.h"

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// How far a first guess may reasonably be off: half of itself, or a twentieth for ratios that start near zero.
double prior_width(double value) { return std::max(0.5 * std::abs(value), 0.05); }

}  // namespace

ResidualTerm what_is_known(std::size_t index, const Parameter& p) {
  return {{index}, 1, [centre = p.start, width = p.known_to](const VectorXd& value, VectorXd& residual, MatrixXd* jacobian) {
            residual[0] = (value[0] - centre) / width;
            if (jacobian != nullptr) (*jacobian)(0, 0) = 1 / width;
            return true;
          }};
}

ResidualTerm weak_prior(std::size_t index, const LeastSquaresUnknown& u) {
  const double centre = std::clamp(u.value, u.lower, u.upper), width = prior_width(centre);
  return {{index}, 1, [centre, width](const VectorXd& value, VectorXd& residual, MatrixXd* jacobian) {
            residual[0] = (value[0] - centre) / width;
            if (jacobian != nullptr) (*jacobian)(0, 0) = 1 / width;
            return true;
          }};
}

JointProblem::JointProblem(const AeroelasticModel& model, std::vector<RunResidual> runs) : model_(&model), runs_(std::move(runs)) {
  const auto& parameters = model.parameters();
  for (std::size_t j = 0; j < parameters.size(); ++j)
    if (!parameters[j].per_run) unknowns_.push_back({static_cast<Index>(j), -1, parameters[j].start, false, {}});
  for (std::size_t r = 0; r < runs_.size(); ++r)
    for (std::size_t j = 0; j < parameters.size(); ++j)
      if (parameters[j].per_run && runs_[r].conditions().speed > 0) unknowns_.push_back({static_cast<Index>(j), static_cast<int>(r), parameters[j].start, false, {}});
}

std::string JointProblem::name(const Unknown& unknown) const {
  const std::string& parameter_name = parameter(unknown).name;
  return unknown.run < 0 ? parameter_name : parameter_name + " (" + runs_[static_cast<std::size_t>(unknown.run)].run().file + ")";
}

JointProblem JointProblem::part(const std::vector<std::size_t>& runs) const {
  std::vector<RunResidual> some;
  for (const std::size_t r : runs) some.push_back(runs_[r]);
  JointProblem part(*model_, std::move(some));
  for (Unknown& u : part.unknowns_) {
    const int run = u.run < 0 ? -1 : static_cast<int>(runs[static_cast<std::size_t>(u.run)]);
    for (const Unknown& known : unknowns_)
      if (known.parameter == u.parameter && known.run == run) u = {known.parameter, u.run, known.value, known.held, known.why_held};
  }
  return part;
}

VectorXd JointProblem::theta(std::size_t run) const {
  VectorXd theta = model_->start_values();
  for (const Unknown& u : unknowns_)
    if (u.run < 0 || u.run == static_cast<int>(run)) theta[u.parameter] = u.value;
  return theta;
}

LeastSquaresProblem JointProblem::least_squares() const {
  LeastSquaresProblem problem;
  problem.least_variance = 1;
  const double highest = highest_nyquist(runs_), nyquist = runs_.empty() || moves_above(*this, theta(0), highest) ? std::numeric_limits<double>::infinity() : highest;
  for (const Unknown& u : unknowns_) {
    const auto [lower, upper] = bounds_at(*model_, u.parameter, u.value);
    problem.unknowns.push_back({name(u), u.value, lower, std::min(upper, stiffest_below(*this, u, nyquist)), u.held, 0});
  }
  for (std::size_t r = 0; r < runs_.size(); ++r) {
    if (runs_[r].is_aside()) continue;
    ResidualTerm term;
    std::vector<Index> parameters;
    for (std::size_t i = 0; i < unknowns_.size(); ++i) {
      if (unknowns_[i].run >= 0 && unknowns_[i].run != static_cast<int>(r)) continue;
      term.unknowns.push_back(i);
      parameters.push_back(unknowns_[i].parameter);
    }
    term.size = static_cast<Index>(model_->parameters().size()) + 1;
    term.evaluate = [this, nyquist, &run = runs_[r], theta = model_->start_values(), parameters, last = RunResidual::Solution()](
                        const VectorXd& values, VectorXd& residual, MatrixXd* jacobian) mutable {
      theta(parameters) = values;
      if (moves_above(*this, theta, nyquist)) return false;
      if (last.theta.size() == 0 || last.theta != theta) last = run.solve(theta);
      if (!std::isfinite(last.chi2)) return false;  // an unstable model
      if (jacobian == nullptr) {
        residual[0] = std::sqrt(last.chi2);
        return true;
      }
      const RunResidual::Evaluation e = run.differentiate(last);
      residual = e.residual;
      *jacobian = e.jacobian(Eigen::all, parameters);
      return true;
    };
    problem.terms.push_back(std::move(term));
    problem.degrees_of_freedom += static_cast<double>(runs_[r].degrees_of_freedom());
  }
  for (std::size_t i = 0; i < unknowns_.size(); ++i) {
    problem.degrees_of_freedom -= unknowns_[i].held ? 0 : 1;
    if (std::isfinite(parameter(unknowns_[i]).known_to)) problem.terms.push_back(what_is_known(i, parameter(unknowns_[i])));
  }
  return problem;
}

JointProblem::Summary JointProblem::solve(const SolveOptions& options) {
  LeastSquaresProblem problem = least_squares();
  problem.terms.insert(problem.terms.end(), options.beside.begin(), options.beside.end());
  for (std::size_t i = 0; options.prior && i < unknowns_.size(); ++i) {
    if (!unknowns_[i].held) problem.terms.push_back(weak_prior(i, problem.unknowns[i]));
  }
  // Held unknowns need no derivatives during the search.
  std::vector<Index> free;
  for (const Unknown& u : unknowns_)
    if (!u.held) free.push_back(u.parameter);
  const bool some_held = std::set<Index>(free.begin(), free.end()).size() < model_->parameters().size();
  constexpr double finest = 3e-3;
  for (RunResidual& run : runs_) {
    if (some_held) run.differentiate_only(free);
    run.search_linear_to(options.prior ? 0.1 : std::max(finest, 0.1 * options.precision));
  }
  LeastSquaresOptions search;
  search.iterations = options.iterations;
  search.relative_change = options.tolerance;
  // promised / chi2 < tolerance is a step of sqrt(tolerance dof) standard errors; a whole record deserves a hundredth of one.
  search.precision = std::sqrt(options.tolerance * std::max(1.0, problem.degrees_of_freedom));
  if (!options.prior) search.precision = std::min(search.precision, options.precision);
  search.effort = options.restarts ? LeastSquaresOptions::Effort::until_arrived : LeastSquaresOptions::Effort::once;
  search.evaluations = options.most_evaluations;
  search.enough = options.enough * problem.degrees_of_freedom;
  search.goal = options.goal;
  const LeastSquaresResult result = solve_least_squares(problem, search);
  for (RunResidual& run : runs_) {
    if (some_held) run.differentiate_only({});
    run.search_linear_to(finest);
  }
  for (std::size_t i = 0; i < unknowns_.size(); ++i) unknowns_[i].value = result.point.values[static_cast<Index>(i)];
  return {result.arrived, result.point.finite ? result.chi2() : std::numeric_limits<double>::infinity(), result.evaluations, result.message, result.out_of_reach};
}

double JointProblem::Linearisation::chi2() const {
  return std::accumulate(run_chi2.begin(), run_chi2.end(), beside_runs);
}

JointProblem::Linearisation JointProblem::linearise() const {
  const auto count = static_cast<Index>(unknowns_.size()), rows = static_cast<Index>(model_->parameters().size()) + 1;
  Linearisation lin;
  std::vector<Index> known;  // beside the runs
  for (Index i = 0; i < count; ++i)
    if (std::isfinite(parameter(unknowns_[static_cast<std::size_t>(i)]).known_to)) known.push_back(i);
  const Index of_runs = rows * static_cast<Index>(runs_.size());
  lin.residual.setZero(of_runs + static_cast<Index>(known.size()));
  lin.jacobian = MatrixXd::Zero(lin.residual.size(), count);
  lin.run_chi2.resize(runs_.size());
  in_parallel(runs_.size(), [&](std::size_t r) {
    if (runs_[r].is_aside()) return;
    const RunResidual::Evaluation e = runs_[r].evaluate(theta(r), Partials::all);
    const Index first = rows * static_cast<Index>(r);
    lin.residual.segment(first, rows) = e.residual;
    for (Index i = 0; i < count; ++i) {
      const Unknown& u = unknowns_[static_cast<std::size_t>(i)];
      if (u.run < 0 || u.run == static_cast<int>(r)) lin.jacobian.col(i).segment(first, rows) = e.jacobian.col(u.parameter);
    }
    lin.run_chi2[r] = e.chi2;
  });
  for (std::size_t k = 0; k < known.size(); ++k) {
    const Unknown& u = unknowns_[static_cast<std::size_t>(known[k])];
    const Parameter& p = parameter(u);
    lin.residual[of_runs + static_cast<Index>(k)] = (u.value - p.start) / p.known_to;
    lin.jacobian(of_runs + static_cast<Index>(k), known[k]) = 1 / p.known_to;
  }
  lin.beside_runs = beside_runs();
  lin.beside_runs_rows = static_cast<Index>(known.size());
  return lin;
}

double JointProblem::chi2() const {
  std::vector<double> of_run(runs_.size());
  in_parallel(runs_.size(), [&](std::size_t r) { of_run[r] = runs_[r].is_aside() ? 0 : runs_[r].evaluate(theta(r), Partials::none).chi2; });
  return std::accumulate(of_run.begin(), of_run.end(), beside_runs());
}

double JointProblem::beside_runs() const {
  double sum = 0;
  for (const Unknown& u : unknowns_) sum += std::pow((u.value - parameter(u).start) / parameter(u).known_to, 2);
  return sum;
}

}  // namespace unrig
