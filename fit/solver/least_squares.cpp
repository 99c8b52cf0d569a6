#include "fit/solver/least_squares.h"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "core/numerics/in_parallel.h"
#include "fit/solver/gauss_newton.h"
#include "fit/solver/trust_region.h"

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using Attempt = LeastSquaresResult::Attempt;

constexpr double arrival = 1e-3;  // relative offset of Bates and Watts

/// One attempt: a search, and Gauss-Newton steps to its end.
class Walk {
 public:
  Walk(const LeastSquaresProblem& problem, const LeastSquaresOptions& options, Index rank_at_start)
      : problem_(problem), options_(options), rank_at_start_(rank_at_start) {}

  int evaluations = 0;
  LeastSquaresPoint point;
  Standing standing;
  bool arrived = false, out_of_reach = false;

  void run(const LeastSquaresPoint& start, SearchStrategy strategy) {
    point = start;
    SearchLimits limits{options_.iterations, options_.relative_change, options_.precision, options_.enough, options_.goal};
    // A search that creeps along a curved valley takes its small steps for convergence: it goes on until it no longer gains.
    constexpr double finer = 1e-3;
    while (true) {
      const double before = point.chi2();
      const SearchOutcome outcome = search(problem_, point, strategy, limits);
      evaluations += outcome.evaluations;
      point = outcome.point;
      if (!point.finite) return;
      standing = unrig::standing(problem_, point);
      arrived = point.chi2() < options_.enough;
      out_of_reach = options_.goal.is_out_of_reach(point.chi2(), standing.next.promised);
      if (arrived || out_of_reach) return;
      evaluations += refine(problem_, options_.precision, point, standing);
      arrived = (standing.step_left <= std::max(arrival, options_.precision) || standing.within_rounding) && standing.next.rank >= rank_at_start_;
      limits.iterations -= std::max(1, outcome.iterations);
      strategy.homotopy_steps = 0;
      if (arrived || limits.iterations <= 0) return;
      if (point.chi2() >= before && limits.relative_change == 0) return;
      limits.relative_change = limits.relative_change > 1e-15 ? finer * limits.relative_change : 0;
    }
  }

 private:
  const LeastSquaresProblem& problem_;
  const LeastSquaresOptions& options_;
  Index rank_at_start_;
};

/// The ways that are tried when the first does not arrive.
std::vector<SearchStrategy> other_strategies() {
  std::vector<SearchStrategy> all;
  const auto add = [&](const char* name, auto set) {
    SearchStrategy s;
    s.name = name;
    set(s);
    all.push_back(s);
  };
  add("cautious first step", [](SearchStrategy& s) { s.first_radius = 1; });
  add("logarithms of the unknowns", [](SearchStrategy& s) { s.logarithms = true; s.first_radius = 1; });
  add("dogleg", [](SearchStrategy& s) { s.dogleg = true; s.first_radius = 1; });
  add("Newton homotopy", [](SearchStrategy& s) { s.homotopy_steps = 10; });
  add("very cautious first step", [](SearchStrategy& s) { s.first_radius = 1e-3; });
  add("nonmonotonic steps", [](SearchStrategy& s) { s.nonmonotonic = true; });
  add("no column scaling", [](SearchStrategy& s) { s.column_scaling = false; });
  return all;
}

/// i-th number of the van der Corput sequence in a base: spread evenly over 0 to 1, the same every time.
double van_der_corput(int i, int base) {
  double x = 0, digit = 1;
  for (; i > 0; i /= base) x += (digit /= base) * (i % base);
  return x;
}

/// The i-th start around the given one: each unknown times or divided by up to 5, or moved by up to its scale where it is zero.
VectorXd spread_start(const LeastSquaresProblem& problem, const VectorXd& values, int i) {
  constexpr int primes[] = {2, 3, 5, 7, 11, 13, 17, 19, 23, 29, 31, 37, 41, 43, 47, 53};
  constexpr double furthest = 5;
  VectorXd start = values;
  for (std::size_t j = 0; j < problem.unknowns.size(); ++j) {
    if (problem.unknowns[j].held) continue;
    const double at = 2 * van_der_corput(i + 1 + static_cast<int>(j / std::size(primes)), primes[j % std::size(primes)]) - 1;
    double& x = start[static_cast<Index>(j)];
    const double scale = problem.unknowns[j].scale > 0 ? problem.unknowns[j].scale : 1;
    x = x != 0 ? x * std::pow(furthest, at) : scale * at;
  }
  return inside_bounds(problem, start);
}

/// What is in the way of a search that has not arrived.
std::string obstacle(const LeastSquaresProblem& problem, const LeastSquaresPoint& start, const LeastSquaresPoint& end, const Standing& standing) {
  if (!start.finite && !end.finite) return "the model has no finite value at the start";
  std::string lost, at_bound;
  for (std::size_t i = 0; i < problem.unknowns.size(); ++i) {
    const auto j = static_cast<Index>(i);
    if (problem.unknowns[i].held) continue;
    constexpr double vanished = 1e-10;
    if (start.finite && end.jacobian.col(j).norm() * std::abs(end.values[j]) < vanished * start.jacobian.col(j).norm() * std::abs(start.values[j]))
      lost += (lost.empty() ? "" : ", ") + problem.unknowns[i].name;
  }
  for (Index j : standing.next.pressed) at_bound += (at_bound.empty() ? "" : ", ") + problem.unknowns[static_cast<std::size_t>(j)].name;
  std::string text = fmt::format("a step of {:.2g} standard errors is left", standing.step_left);
  if (!lost.empty()) text = fmt::format("the data stopped responding to {} (now far from the start)", lost);
  if (!at_bound.empty()) text += fmt::format("; at a bound: {}", at_bound);
  return text;
}

LeastSquaresPoint evaluate(const LeastSquaresProblem& problem, const VectorXd& values, bool derivatives) {
  LeastSquaresPoint point{values, VectorXd::Zero(problem.residuals()), {}, true};
  if (derivatives) point.jacobian.setZero(problem.residuals(), values.size());
  std::vector<Index> first{0};
  for (const ResidualTerm& term : problem.terms) first.push_back(first.back() + term.size);
  std::atomic<bool> finite{true};
  in_parallel(problem.terms.size(), [&](std::size_t t) {
    const ResidualTerm& term = problem.terms[t];
    const auto count = static_cast<Index>(term.unknowns.size());
    const std::vector<Index> columns(term.unknowns.begin(), term.unknowns.end());
    VectorXd residual = VectorXd::Zero(term.size);
    MatrixXd jacobian = MatrixXd::Zero(term.size, derivatives ? count : 0);
    if (!finite || !term.evaluate(values(columns), residual, derivatives ? &jacobian : nullptr) || !residual.allFinite() || !jacobian.allFinite()) {
      finite = false;
      return;
    }
    point.residual.segment(first[t], term.size) = residual;
    for (Index a = 0; a < jacobian.cols(); ++a) point.jacobian.col(columns[static_cast<std::size_t>(a)]).segment(first[t], term.size) += jacobian.col(a);
  });
  point.finite = finite && std::isfinite(point.chi2());
  return point;
}

void check(const LeastSquaresProblem& problem) {
  for (const LeastSquaresUnknown& u : problem.unknowns)
    if (!std::isfinite(u.value)) throw std::invalid_argument(fmt::format("the start value of {} is not finite", u.name));
  for (const ResidualTerm& term : problem.terms)
    for (std::size_t i : term.unknowns)
      if (i >= problem.unknowns.size()) throw std::invalid_argument(fmt::format("a residual term asks for unknown {} of {}", i + 1, problem.unknowns.size()));
}

}  // namespace

VectorXd LeastSquaresProblem::values() const {
  VectorXd x(static_cast<Index>(unknowns.size()));
  for (std::size_t i = 0; i < unknowns.size(); ++i) x[static_cast<Index>(i)] = unknowns[i].value;
  return x;
}

Index LeastSquaresProblem::residuals() const {
  Index count = 0;
  for (const ResidualTerm& term : terms) count += term.size;
  return count;
}

LeastSquaresPoint linearise(const LeastSquaresProblem& problem, const VectorXd& values) { return evaluate(problem, values, true); }
LeastSquaresPoint try_values(const LeastSquaresProblem& problem, const VectorXd& values) { return evaluate(problem, values, false); }

double variance_factor(const LeastSquaresProblem& problem, double chi2) {
  double freedom = problem.degrees_of_freedom;
  if (freedom == 0) {
    const auto free = std::count_if(problem.unknowns.begin(), problem.unknowns.end(), [](const LeastSquaresUnknown& u) { return !u.held; });
    freedom = static_cast<double>(problem.residuals() - free);
  }
  return freedom > 0 ? chi2 / freedom : 1;
}

void take(const LeastSquaresPoint& point, LeastSquaresProblem& problem) {
  for (std::size_t i = 0; i < problem.unknowns.size(); ++i) problem.unknowns[i].value = point.values[static_cast<Index>(i)];
}

LeastSquaresResult solve_least_squares(const LeastSquaresProblem& problem, const LeastSquaresOptions& options) {
  check(problem);
  const LeastSquaresPoint start = linearise(problem, inside_bounds(problem, problem.values()));
  const Index rank = start.finite ? gauss_newton(problem, start).rank : 0;
  LeastSquaresResult result;
  result.point = start;
  result.evaluations = 1;
  Standing best;
  int agreeing = 0, elsewhere = 0;  // attempts that arrived: at the least chi2 so far, and at others
  const auto attempt = [&](const LeastSquaresPoint& from, const SearchStrategy& strategy) {
    Walk walk(problem, options, rank);
    walk.run(from, strategy);
    result.evaluations += walk.evaluations;
    result.attempts.push_back({strategy.name, walk.arrived, walk.point.finite ? walk.point.chi2() : std::nan(""), walk.evaluations});
    if (!walk.point.finite) return;
    constexpr double same = 1e-6;
    const double chi2 = walk.point.chi2(), least = result.chi2();
    const bool first = !result.point.finite || result.attempts.size() == 1, lower = first || chi2 < least * (1 - same);
    const bool as_low = lower || chi2 <= least * (1 + same);
    if (lower) elsewhere += std::exchange(agreeing, 0);
    if (walk.arrived) ++(as_low ? agreeing : elsewhere);
    // Of two that are as low, the one that has arrived, or is nearer.
    const bool nearer = std::make_pair(!walk.arrived, walk.standing.step_left) < std::make_pair(!result.arrived, result.step_left);
    if (!lower && !(as_low && nearer)) return;
    result.point = walk.point, best = walk.standing;
    result.arrived = walk.arrived, result.step_left = best.step_left, result.out_of_reach = walk.out_of_reach;
  };
  attempt(start, {});
  const bool first_arrived = result.arrived;
  const auto enough = [&] {
    if (options.effort == LeastSquaresOptions::Effort::once || result.evaluations >= options.evaluations) return true;
    if (options.effort == LeastSquaresOptions::Effort::exhaustive) return false;
    return first_arrived || agreeing >= 2;
  };
  for (const SearchStrategy& strategy : other_strategies())
    if (!enough() && start.finite) attempt(start, strategy);
  // Where all that arrived from the given start arrived at one place, that is it.
  const bool unambiguous = options.effort != LeastSquaresOptions::Effort::exhaustive && result.arrived && elsewhere == 0;
  constexpr int spread_starts = 20;
  for (int i = 1; i <= spread_starts && !unambiguous && !enough(); ++i) {
    const LeastSquaresPoint other = linearise(problem, spread_start(problem, start.values, i));
    ++result.evaluations;
    if (!other.finite) continue;
    SearchStrategy strategy;
    strategy.name = fmt::format("start {} around the given one", i);
    attempt(other, strategy);
  }
  result.message = result.arrived ? fmt::format("arrived after {} evaluations", result.evaluations) : "not arrived: " + obstacle(problem, start, result.point, best);
  if (result.attempts.size() > 1 && result.arrived)
    result.message += fmt::format("; {} of {} attempts ended at this least chi-square", agreeing, result.attempts.size());
  return result;
}

}  // namespace unrig
