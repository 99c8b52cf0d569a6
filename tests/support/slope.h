#pragma once
#include <gtest/gtest.h>

#include <Eigen/Core>
#include <cmath>

namespace unrig::test {

/// Is `slope` the derivative of f(h) at h = 0?
///
/// The central difference over a step h misses a derivative by c h^2, so that halving the step must divide the miss by four. A wrong slope leaves a
/// miss that does not fall. `round_off` is the relative error with which f is evaluated; where that hides the miss (a function that is
/// linear or quadratic in h has none) the slope counts as right, provided that the step is long enough for an error of 1e-5 to be seen.
template <class F>
::testing::AssertionResult is_slope(const F& f, const Eigen::MatrixXd& slope, double step, double round_off = 1e-13) {
  const auto miss = [&](double h) { return ((f(h) - f(-h)) / (2 * h) - slope).eval().norm(); };
  const double coarse = miss(step), fine = miss(step / 2);
  const double hidden = 2 * round_off * Eigen::MatrixXd(f(0)).norm() / step;
  if (slope.norm() > 0 && hidden > 1e-5 * slope.norm())
    return ::testing::AssertionFailure() << "a step of " << step << " is too short: round-off " << hidden << " beside a slope of " << slope.norm();
  if (fine <= hidden) return ::testing::AssertionSuccess();
  const double order = std::log2(coarse / fine);
  if (order > 1.8 && order < 2.2 && fine < 0.05 * slope.norm()) return ::testing::AssertionSuccess();
  return ::testing::AssertionFailure() << "steps of " << step << " and half of it miss the slope (norm " << slope.norm() << ") by " << coarse << " and "
                                       << fine << ": order " << order << ", 2 expected; round-off is " << hidden;
}

}  // namespace unrig::test
