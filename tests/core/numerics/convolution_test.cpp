#include "core/numerics/convolution.h"

#include <gtest/gtest.h>

#include <cmath>
#include <complex>

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXcd;
using Eigen::VectorXd;
using Direction = Convolution::Direction;

TEST(Convolution, SumsOverPastAndFutureAsWritten) {
  constexpr double rounding = 1e-13;  // 60 products of numbers below 1
  for (const Index n : {1, 2, 7, 60}) {
    const VectorXd h = VectorXd::NullaryExpr(n, [](Index i) { return std::cos(1.7 * static_cast<double>(i * i)); }), x = VectorXd::NullaryExpr(n, [](Index i) { return std::sin(0.9 * static_cast<double>(i) + 0.3); });
    const Convolution convolution(n);
    const Convolution::Kernel kernel = convolution.kernel(h, {});
    const MatrixXd sums = convolution.sums({{&kernel, x.data(), Direction::past, 0}, {&kernel, x.data(), Direction::future, 1}}, 2);
    ASSERT_EQ(sums.rows(), n);
    for (Index k = 0; k < n; ++k) {
      double before = 0, behind = 0;
      for (Index i = 0; i <= k; ++i) before += h[i] * x[k - i];
      for (Index i = 0; k + i < n; ++i) behind += h[i] * x[k + i];
      EXPECT_NEAR(sums(k, 0), before, rounding) << n << ", " << k;
      EXPECT_NEAR(sums(k, 1), behind, rounding) << n << ", " << k;
    }
    EXPECT_NEAR(convolution.mean(kernel.fine.cwiseAbs2()), h.squaredNorm(), rounding * static_cast<double>(n)) << "Parseval";
  }
}

/// Something fast that rings, and something slow that outlasts the record.
double ringing_and_slow(double i) { return std::exp(-i / 8) * std::cos(0.8 * i) + 2e-3 * std::exp(-i / 400) + 1e-3 * (1 + i / 3000) * std::exp(-i / 8000); }

TEST(Convolution, PiecesMakeTheWhole) {
  constexpr Index n = 20011, near = 512;
  const auto h = [](Index count, Index first, Index stride) { return VectorXd(VectorXd::NullaryExpr(count, [=](Index i) { return ringing_and_slow(static_cast<double>(first + i * stride)); })); };
  const VectorXd x = VectorXd::NullaryExpr(n, [](Index k) { return 1 + std::sin(0.9 * static_cast<double>(k)) + std::cos(1e-7 * static_cast<double>(k * k)); }), y = x.reverse().cwiseAbs2();
  const Convolution whole(n), pieces(n, near);
  ASSERT_GT(pieces.far(), 0);
  const auto sums = [&](const Convolution& convolution, const std::vector<Index>& at) {
    const Convolution::Kernel kernel = convolution.kernel(h(convolution.near(), 0, 1), h(convolution.far(), convolution.half(), convolution.stride()));
    return convolution.sums({{&kernel, x.data(), Direction::past, 0}, {&kernel, y.data(), Direction::past, 1}, {&kernel, x.data(), Direction::future, 1}}, 2, at);
  };
  const MatrixXd expected = sums(whole, {}), found = sums(pieces, {});
  // The ramp's fourth derivative, 2520 / 256^4 at most, makes splines two samples apart wrong by 5e-8 of what is slow, 3e-3, over the ramp's 256 samples, of either sign: 8e-10 measured.
  constexpr double between_nodes = 2e-9;
  EXPECT_LT((found - expected).cwiseAbs().maxCoeff(), between_nodes);
  EXPECT_GT(expected.cwiseAbs().maxCoeff(), 1);
  const std::vector<Index> some{0, 3, 4000, 4001, 9999, n - 1};
  EXPECT_LT((sums(pieces, some) - expected(some, Eigen::all)).cwiseAbs().maxCoeff(), between_nodes);
  EXPECT_LT((sums(whole, some) - expected(some, Eigen::all)).cwiseAbs().maxCoeff(), 1e-12);
}

TEST(Convolution, PiecesAreAsLongAsSomethingRings) {
  constexpr Index n = 1000000;
  const auto rings_for = [](double samples, double per_sample) { return VectorXcd{{std::exp(std::complex<double>(-1 / samples, per_sample)), 0.5}}; };
  const Index soon = near_samples(rings_for(100, 0.1), n), later = near_samples(rings_for(1000, 0.1), n);
  EXPECT_GT(soon, 0);
  EXPECT_GT(later, soon);
  EXPECT_LT(std::exp(-0.5 * static_cast<double>(later) / 1000), 1e-5) << "what rings on is cut off in the middle";
  EXPECT_EQ(near_samples(rings_for(1e6, 0), n), soon) << "a slow lag is smooth";
  EXPECT_EQ(near_samples(rings_for(1e6, 0.1), n), 0) << "rings through the whole record";
  EXPECT_EQ(near_samples(rings_for(-1e4, 0.1), n), 0) << "grows";
  EXPECT_EQ(near_samples(rings_for(100, 0.1), 5000), 0) << "short";
}

TEST(Convolution, RefusesWhatDoesNotFit) {
  const Convolution convolution(10);
  EXPECT_THROW(convolution.kernel(VectorXd::Zero(1000), {}), std::invalid_argument);
  EXPECT_THROW(convolution.kernel(VectorXd::Zero(10), VectorXd::Zero(1)), std::invalid_argument);
  EXPECT_THROW(Convolution(10, 512), std::invalid_argument);
  EXPECT_THROW(Convolution(10000, 500), std::invalid_argument);
}

}  // namespace
}  // namespace unrig
