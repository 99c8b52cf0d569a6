#include "core/convolution.h"

#include <gtest/gtest.h>

#include <cmath>

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

TEST(Convolution, SumsOverPastAndFutureAsWritten) {
  constexpr double rounding = 1e-13;  // 60 products of numbers below 1
  for (const Index n : {1, 2, 7, 60}) {
    const VectorXd h = VectorXd::NullaryExpr(n, [](Index i) { return std::cos(1.7 * static_cast<double>(i * i)); }), x = VectorXd::NullaryExpr(n, [](Index i) { return std::sin(0.9 * static_cast<double>(i) + 0.3); });
    const Convolution convolution(n);
    const Eigen::VectorXcd h_lines = convolution.transform(h), x_lines = convolution.transform(x);
    const VectorXd past = convolution.past(h_lines, x_lines), future = convolution.future(h_lines, x_lines);
    ASSERT_EQ(past.size(), n);
    for (Index k = 0; k < n; ++k) {
      double before = 0, behind = 0;
      for (Index i = 0; i <= k; ++i) before += h[i] * x[k - i];
      for (Index i = 0; k + i < n; ++i) behind += h[i] * x[k + i];
      EXPECT_NEAR(past[k], before, rounding) << n << ", " << k;
      EXPECT_NEAR(future[k], behind, rounding) << n << ", " << k;
    }
    EXPECT_NEAR(convolution.mean(h_lines.cwiseAbs2()), h.squaredNorm(), rounding * static_cast<double>(n)) << "Parseval";
  }
}

TEST(Convolution, RefusesWhatDoesNotFit) {
  const Convolution convolution(10);
  EXPECT_THROW(convolution.transform(VectorXd::Zero(1000)), std::invalid_argument);
  EXPECT_THROW(convolution.inverse(Eigen::VectorXcd::Zero(3)), std::invalid_argument);
}

}  // namespace
}  // namespace unrig
