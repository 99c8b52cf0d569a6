#include "correct/long_motion/settled_smoother.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <cmath>
#include <memory>

#include "core/files/error.h"

// Filter and smoother against what they stand for: the Gaussian distribution of all samples at once, by dense algebra.

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::RowVectorXd;
using Eigen::VectorXd;

/// A position that white noise accelerates, and an oscillator that it drives; both are looked at.
struct Example {
  MatrixXd F{{1, 0.1, 0, 0}, {0, 1, 0, 0}, {0, 0, 0.94, 0.3}, {0, 0, -0.3, 0.94}};
  VectorXd b{{0.005, 0.1, 0, 0.4}};
  MatrixXd C{{1, 0, 0, 0}, {0.3, 0, 1, -0.2}};
  VectorXd r{{0.04, 0.09}};
};

TEST(SettledFilter, IsWhereTheFilterArrives) {
  const Example e;
  const SettledFilter filter = settle(e.F, e.b, e.C, e.r);
  MatrixXd P = MatrixXd::Identity(4, 4);
  for (int k = 0; k < 2000; ++k) {
    const MatrixXd S = e.C * P * e.C.transpose() + MatrixXd(e.r.asDiagonal());
    P = (e.F * (P - P * e.C.transpose() * S.inverse() * e.C * P) * e.F.transpose() + e.b * e.b.transpose()).eval();
  }
  EXPECT_LT((filter.P - P).cwiseAbs().maxCoeff(), 1e-12 * P.cwiseAbs().maxCoeff());
  const MatrixXd S = e.C * P * e.C.transpose() + MatrixXd(e.r.asDiagonal());
  EXPECT_LT((filter.whiten * S * filter.whiten.transpose() - MatrixXd::Identity(2, 2)).cwiseAbs().maxCoeff(), 1e-11);
  EXPECT_NEAR(filter.log_determinant, std::log(S.determinant()), 1e-11);
}

TEST(SettledFilter, RefusesWhatRunsAwayUnseen) {
  Example e;
  e.F(3, 3) = 1.2, e.F(2, 3) = e.F(3, 2) = 0;
  e.C.col(3).setZero();
  EXPECT_THROW(settle(e.F, e.b, e.C, e.r), NoAnswer);
}

TEST(SettledSmoother, IsTheMeanForGivenReadings) {
  const Example e;
  constexpr Index n = 50, states = 4, channels = 2;
  const SettledFilter filter = settle(e.F, e.b, e.C, e.r);
  const auto convolution = std::make_shared<const Convolution>(n);
  const SettledSmoother smoother(filter, convolution);
  const MatrixXd y = MatrixXd::NullaryExpr(n, channels, [](Index k, Index c) { return std::sin(0.37 * static_cast<double>(k * (c + 1) * k) + static_cast<double>(c)); });

  // States of all samples are G z, z = (the first state over the root of P, noise of each step).
  MatrixXd G = MatrixXd::Zero(n * states, states + n - 1);
  G.topLeftCorner(states, states) = filter.P.llt().matrixL();
  for (Index k = 1; k < n; ++k) {
    G.middleRows(k * states, states) = e.F * G.middleRows((k - 1) * states, states);
    G.block(k * states, states + k - 1, states, 1) += e.b;
  }
  MatrixXd see = MatrixXd::Zero(n * channels, n * states), noise = MatrixXd::Zero(n * channels, n * channels);
  VectorXd reading(n * channels);
  for (Index k = 0; k < n; ++k) {
    see.block(k * channels, k * states, channels, states) = e.C;
    noise.block(k * channels, k * channels, channels, channels) = e.r.asDiagonal();
    reading.segment(k * channels, channels) = y.row(k).transpose();
  }
  const MatrixXd prior = G * G.transpose(), of_reading = see * prior * see.transpose() + noise;
  const Eigen::LLT<MatrixXd> llt(of_reading);
  const VectorXd mean = prior * see.transpose() * llt.solve(reading);
  const MatrixXd covariance = prior - prior * see.transpose() * llt.solve(see * prior);

  constexpr double rounding = 1e-10;
  const SettledSmoother::Series series = smoother.series(y);
  EXPECT_NEAR(series.white.squaredNorm(), reading.dot(llt.solve(reading)), rounding * series.white.squaredNorm());
  EXPECT_NEAR(static_cast<double>(n) * filter.log_determinant, 2 * MatrixXd(llt.matrixL()).diagonal().array().log().sum(), 1e-8);
  EXPECT_LT((series.white - smoother.innovations(y)).cwiseAbs().maxCoeff(), rounding);
  for (const RowVectorXd& q : {RowVectorXd{{1, 0, 0, 0}}, RowVectorXd{{0, 0, 0, 1}}, RowVectorXd{{0.5, -1, 2, 0.1}}}) {
    const SettledSmoother::Quantity quantity = smoother.quantity(q);
    const VectorXd smoothed = smoother.smoothed(quantity, series), variance = smoother.variance(q);
    for (Index k = 0; k < n; ++k) {
      EXPECT_NEAR(smoothed[k], q.dot(mean.segment(k * states, states)), rounding) << k;
      EXPECT_NEAR(variance[k], (q * covariance.block(k * states, k * states, states, states) * q.transpose()).value(), rounding) << k;
    }
  }
}

TEST(SettledSmoother, NoisePassesThroughAsAUnitDoes) {
  const Example e;
  constexpr Index n = 400;
  const auto convolution = std::make_shared<const Convolution>(n);
  const SettledSmoother smoother(settle(e.F, e.b, e.C, e.r), convolution);
  const SettledSmoother::Quantity q = smoother.quantity(RowVectorXd::Unit(4, 1));
  const VectorXd passed = smoother.passed_on(q);
  for (Index c = 0; c < 2; ++c) {
    MatrixXd unit = MatrixXd::Zero(n, 2);
    unit(n / 2, c) = 1;
    // The same sum, cut off where less than 1e-8 of the answer to a unit is left.
    EXPECT_NEAR(passed[c], smoother.smoothed(q, smoother.series(unit)).squaredNorm(), 1e-7 * passed[c]) << c;
  }
  EXPECT_LT(passed.dot(e.r), smoother.variance(RowVectorXd::Unit(4, 1))[n / 2]) << "the rest is what the noise of the motion leaves open";
}

}  // namespace
}  // namespace unrig
