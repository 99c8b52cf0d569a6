#include "fit/solver/gauss_newton.h"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <deque>
#include <limits>

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

bool no_digit_moves(const VectorXd& step, const VectorXd& values) {
  return (step.array().abs() <= std::numeric_limits<double>::epsilon() * values.array().abs()).all();
}

/// Steps x_k -> x_k + s_k, and where they lead if s goes on changing with x as it did.
class Anderson {
 public:
  /// The accelerated step from the present point; empty where there is nothing to learn from yet.
  VectorXd step(const LeastSquaresPoint& point, const GaussNewton& next) {
    constexpr std::size_t memory = 5;
    if (next.free != free_) past_.clear(), free_ = next.free;
    VectorXd accelerated;
    const auto depth = static_cast<Index>(std::min(past_.size(), next.free.size()));
    if (depth > 0) {
      MatrixXd dx(point.values.size(), depth), ds(point.values.size(), depth);
      for (Index i = 0; i < depth; ++i) {
        const auto& [x, s] = past_[static_cast<std::size_t>(i)];
        dx.col(i) = point.values - x;
        ds.col(i) = next.step - s;
      }
      // In the residuals' own metric, where all unknowns weigh by what they do.
      const VectorXd weight = (point.jacobian * ds).colPivHouseholderQr().solve(point.jacobian * next.step);
      accelerated = next.step - (dx + ds) * weight;
    }
    past_.emplace_front(point.values, next.step);
    if (past_.size() > memory) past_.pop_back();
    return accelerated;
  }

 private:
  std::deque<std::pair<VectorXd, VectorXd>> past_;
  std::vector<Index> free_;
};

}  // namespace

bool pressed_against_bound(const LeastSquaresUnknown& unknown, double value, double slope) {
  return (value <= unknown.lower && slope > 0) || (value >= unknown.upper && slope < 0);
}

GaussNewton gauss_newton(const LeastSquaresProblem& problem, const LeastSquaresPoint& point) {
  constexpr double no_response = 1e-13;
  GaussNewton result;
  const VectorXd slope = point.jacobian.transpose() * point.residual;
  VectorXd swing = VectorXd::Zero(point.residual.size());
  for (std::size_t i = 0; i < problem.unknowns.size(); ++i) {
    const auto j = static_cast<Index>(i);
    if (problem.unknowns[i].held) continue;
    const bool pressed = pressed_against_bound(problem.unknowns[i], point.values[j], slope[j]);
    (pressed ? result.pressed : result.free).push_back(j);
    swing += point.jacobian.col(j).cwiseAbs() * std::abs(point.values[j]);
  }
  result.rounding = (std::numeric_limits<double>::epsilon() * swing).squaredNorm();
  result.rank = static_cast<Index>(result.pressed.size());
  result.step = VectorXd::Zero(point.values.size());
  const auto count = static_cast<Index>(result.free.size());
  if (count == 0 || point.residual.size() == 0) return result;

  MatrixXd scaled = point.jacobian(Eigen::all, result.free);
  VectorXd inverse_length(count);
  for (Index a = 0; a < count; ++a) {
    const double length = scaled.col(a).stableNorm();
    inverse_length[a] = length > 0 ? 1 / length : 0;
    scaled.col(a) *= inverse_length[a];
  }
  Eigen::ColPivHouseholderQR<MatrixXd> qr;
  qr.setThreshold(no_response);
  qr.compute(scaled);
  result.rank += qr.rank();
  const VectorXd rotated = qr.householderQ().adjoint() * point.residual;
  result.promised = rotated.head(qr.rank()).squaredNorm();
  const VectorXd step = qr.solve(-point.residual).cwiseProduct(inverse_length);
  for (Index a = 0; a < count; ++a) result.step[result.free[static_cast<std::size_t>(a)]] = step[a];
  return result;
}

Standing standing(const LeastSquaresProblem& problem, const LeastSquaresPoint& point) {
  Standing s;
  s.next = gauss_newton(problem, point);
  const double variance = std::max(problem.least_variance, variance_factor(problem, point.chi2()));
  s.step_left = variance > 0 ? std::sqrt(s.next.promised / variance) : 0;
  constexpr double within_rounding = 100;  // ten times in length: a model rounds more than its values
  s.within_rounding = s.next.promised <= within_rounding * s.next.rounding;
  return s;
}

VectorXd inside_bounds(const LeastSquaresProblem& problem, VectorXd values) {
  for (std::size_t i = 0; i < problem.unknowns.size(); ++i) {
    const LeastSquaresUnknown& u = problem.unknowns[i];
    double& x = values[static_cast<Index>(i)];
    if (!u.held) x = std::clamp(x, u.lower, u.upper);
  }
  return values;
}

int refine(const LeastSquaresProblem& problem, double precision, LeastSquaresPoint& point, Standing& here) {
  constexpr int most_steps = 60, most_halvings = 4;
  // Near the end chi-square is flat within its rounding, and only the step left tells.
  constexpr double flat = 1e-10, shorter = 0.9;
  Anderson anderson;
  int evaluations = 0;
  here = standing(problem, point);
  const auto nearer = [&](const VectorXd& step) {
    const LeastSquaresPoint trial = linearise(problem, inside_bounds(problem, point.values + step));
    ++evaluations;
    if (!trial.finite) return false;
    Standing there = standing(problem, trial);
    const bool better = trial.chi2() < point.chi2() * (1 - flat) || (trial.chi2() <= point.chi2() * (1 + flat) && there.step_left < shorter * here.step_left);
    if (better) point = trial, here = std::move(there);
    return better;
  };
  for (int i = 0; i < most_steps; ++i) {
    if (here.step_left <= precision || no_digit_moves(here.next.step, point.values)) break;
    const VectorXd accelerated = anderson.step(point, here.next), plain = here.next.step;
    bool moved = accelerated.size() > 0 && nearer(accelerated);
    for (int halving = 0; !moved && halving <= (here.within_rounding ? 0 : most_halvings); ++halving) moved = nearer(plain / (1 << halving));
    if (!moved) break;
  }
  return evaluations;
}

}  // namespace unrig
