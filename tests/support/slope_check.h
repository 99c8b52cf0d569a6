#pragma once
#include <gtest/gtest.h>

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <vector>

namespace unrig::test {

/// How the linear model f(x) + h J d misses f(x + h d) as h is halved: an exact J leaves a miss of order h^2 (Taylor), a wrong one of order h.
struct Slope {
  double order = 0;    ///< log2 of the ratio of two successive misses, in the middle of the steps that rounding does not reach
  bool exact = false;  ///< all misses are within rounding: f is linear along d, and J is its slope
};

/// `rounding`: relative error of f's values. `largest_step` is halved 24 times.
inline Slope slope_along(const std::function<Eigen::VectorXd(const Eigen::VectorXd&)>& f, const Eigen::MatrixXd& jacobian, const Eigen::VectorXd& x,
                         const Eigen::VectorXd& direction, double largest_step = 0.125, double rounding = 1e-14) {
  constexpr int halvings = 24;
  const Eigen::VectorXd at = f(x), slope = jacobian * direction;
  std::vector<double> orders;
  double last = 0;
  bool exact = true;
  for (int i = 0; i <= halvings; ++i) {
    const double h = std::ldexp(largest_step, -i);
    const Eigen::VectorXd there = f(x + h * direction);
    const double miss = (there - at - h * slope).norm(), floor = 100 * rounding * std::max(at.norm(), there.norm());
    if (miss > floor) exact = false;
    if (i > 0 && miss > floor && last > floor) orders.push_back(std::log2(last / miss));
    last = miss;
  }
  if (exact || orders.empty()) return {exact ? std::numeric_limits<double>::infinity() : 0, exact};
  // The first steps may be too long for Taylor's order, the last are near rounding: the median is neither.
  std::nth_element(orders.begin(), orders.begin() + static_cast<std::ptrdiff_t>(orders.size() / 2), orders.end());
  return {orders[orders.size() / 2], false};
}

/// For EXPECT_TRUE: every column of `jacobian` is the slope of f at x. `scale`: steps of each unknown; empty: its own size, or 1 where it is 0.
/// A wrong one leaves order 1; terms beyond the second make the median order differ from 2 by less than 0.1.
inline testing::AssertionResult is_slope(const std::function<Eigen::VectorXd(const Eigen::VectorXd&)>& f, const Eigen::MatrixXd& jacobian,
                                         const Eigen::VectorXd& x, Eigen::VectorXd scale = {}, double rounding = 1e-14) {
  if (scale.size() == 0) scale = x.unaryExpr([](double v) { return v == 0 ? 1.0 : std::abs(v); });
  if (!jacobian.allFinite()) return testing::AssertionFailure() << "the derivative is not finite";
  for (Eigen::Index j = 0; j < x.size(); ++j) {
    const Slope slope = slope_along(f, jacobian, x, scale[j] * Eigen::VectorXd::Unit(x.size(), j), 0.125, rounding);
    if (!slope.exact && slope.order < 1.8)
      return testing::AssertionFailure() << "the derivative by unknown " << j << " misses with order " << slope.order << ", not 2";
  }
  return testing::AssertionSuccess();
}

}  // namespace unrig::test
