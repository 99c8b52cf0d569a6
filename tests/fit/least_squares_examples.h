#pragma once
#include <Eigen/Core>
#include <Eigen/LU>
#include <cmath>
#include <functional>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "fit/solver/least_squares.h"

/// Small problems with known answers.
namespace unrig::test {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// residual and Jacobian at some values
using Evaluate = std::function<bool(const VectorXd&, VectorXd&, MatrixXd&)>;

inline LeastSquaresProblem problem_of(std::vector<LeastSquaresUnknown> unknowns, Index residuals, Evaluate evaluate) {
  LeastSquaresProblem problem;
  ResidualTerm term;
  for (std::size_t i = 0; i < unknowns.size(); ++i) term.unknowns.push_back(i);
  term.size = residuals;
  term.evaluate = [evaluate = std::move(evaluate), residuals, count = static_cast<Index>(unknowns.size())](const VectorXd& values, VectorXd& residual,
                                                                                                          MatrixXd* jacobian) {
    MatrixXd unasked = MatrixXd::Zero(residuals, count);
    return evaluate(values, residual, jacobian != nullptr ? *jacobian : unasked);
  };
  problem.unknowns = std::move(unknowns);
  problem.terms.push_back(std::move(term));
  return problem;
}

/// r = A x - y.
inline LeastSquaresProblem linear(std::vector<LeastSquaresUnknown> unknowns, const MatrixXd& a, const VectorXd& y) {
  return problem_of(std::move(unknowns), y.size(), [a, y](const VectorXd& x, VectorXd& residual, MatrixXd& jacobian) {
    residual = a * x - y;
    jacobian = a;
    return true;
  });
}

/// A straight line through five points that scatter, columns of very different size.
struct Line {
  MatrixXd a = MatrixXd(5, 2);
  VectorXd y = VectorXd(5);
  Line() {
    for (Index i = 0; i < 5; ++i) a.row(i) << 1e4, 1e-3 * static_cast<double>(i);
    y << 0.1, 0.9, 2.2, 2.8, 4.1;
  }
  MatrixXd covariance() const { return (a.transpose() * a).inverse(); }
  VectorXd solution() const { return covariance() * a.transpose() * y; }
};

inline LeastSquaresUnknown named(const char* name, double value) {
  LeastSquaresUnknown u;
  u.name = name;
  u.value = value;
  return u;
}

/// y = exp(-rate t): has no answer for rates above 3, as an unstable model has none.
inline LeastSquaresProblem decay(double start, double rate, double wall = 3) {
  return problem_of({named("rate", start)}, 8, [rate, wall](const VectorXd& x, VectorXd& r, MatrixXd& jacobian) {
    for (Index i = 0; i < 8; ++i) {
      const double t = 0.5 * static_cast<double>(i);
      // Scatter that is orthogonal to nothing in particular, one per mille.
      r[i] = 1000 * (std::exp(-x[0] * t) - std::exp(-rate * t)) + std::cos(5.0 * static_cast<double>(i));
      jacobian(i, 0) = -1000 * t * std::exp(-x[0] * t);
    }
    if (x[0] > wall) r[3] = std::numeric_limits<double>::quiet_NaN();
    return true;
  });
}

/// Stiffness, damping and mass of a free decay: the data see k/m and c/m only.
inline LeastSquaresProblem free_decay(double k, double c, double m) {
  return problem_of({named("k", k), named("c", c), named("m", m)}, 12, [](const VectorXd& x, VectorXd& r, MatrixXd& jacobian) {
    for (Index i = 0; i < 12; ++i) {
      const double t = static_cast<double>(i), u = std::sin(t), v = std::cos(2 * t);
      r[i] = u * x[0] / x[2] + v * x[1] / x[2] - 2 * u - 0.1 * v + 0.01 * std::sin(7 * t);
      jacobian.row(i) << u / x[2], v / x[2], -(u * x[0] + v * x[1]) / (x[2] * x[2]);
    }
    return true;
  });
}

}  // namespace unrig::test
