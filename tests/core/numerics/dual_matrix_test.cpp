#include "core/numerics/dual_matrix.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "tests/support/random_matrix.h"
#include "tests/support/slope.h"

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using test::random_matrix;
using test::is_slope;

/// M(theta) = M0 + theta_0 M1 + theta_0^2 M2 + theta_1 M3, one of three parameters without effect.
struct Family {
  MatrixXd m0, m1, m2, m3;
  Family(Index rows, Index cols, unsigned seed)
      : m0(random_matrix(rows, cols, seed)),
        m1(random_matrix(rows, cols, seed + 1)),
        m2(random_matrix(rows, cols, seed + 2)),
        m3(random_matrix(rows, cols, seed + 3)) {}

  MatrixXd value(const VectorXd& theta) const { return m0 + theta[0] * m1 + theta[0] * theta[0] * m2 + theta[1] * m3; }
  DualMatrix dual(const VectorXd& theta) const {
    DualMatrix d(value(theta), 3);
    d.add_partial(0, m1);
    d.add_partial(0, 2 * theta[0] * m2);
    d.add_partial(1, m3);
    return d;
  }
};

const VectorXd at = (VectorXd(3) << 0.3, -0.2, 5).finished();

/// `operation` maps theta to a dual matrix; its partials must be the slopes of its value.
void expect_slopes(const std::function<DualMatrix(const VectorXd&)>& operation, double step = 1e-3) {
  const DualMatrix here = operation(at);
  for (Index j = 0; j < 2; ++j) {
    ASSERT_TRUE(here.depends_on(j));
    EXPECT_TRUE(is_slope([&](double h) { return operation(at + h * VectorXd::Unit(3, j)).value; }, here.d(j), step)) << "parameter " << j;
  }
  EXPECT_FALSE(here.depends_on(2)) << "a partial that is zero costs nothing";
}

TEST(DualMatrix, SumsAndProductsCarryTheirSlopes) {
  const Family a(3, 4, 10), b(4, 2, 20), c(3, 2, 30);
  const MatrixXd left = random_matrix(5, 3, 40);
  expect_slopes([&](const VectorXd& t) { return a.dual(t) * b.dual(t) + c.dual(t); });
  expect_slopes([&](const VectorXd& t) { return left * (c.dual(t) - 2.5 * (a.dual(t) * b.dual(t))); });
}

TEST(DualMatrix, ConstantsMayStandBesideDuals) {
  const Family a(3, 3, 10);
  const DualMatrix constant(random_matrix(3, 3, 50));
  const DualMatrix sum = constant + a.dual(at), difference = a.dual(at) - constant, product = constant * a.dual(at);
  EXPECT_EQ(sum.d(0), a.dual(at).d(0));
  EXPECT_EQ(difference.d(1), a.dual(at).d(1));
  EXPECT_EQ(product.d(1), constant.value * a.m3);
  EXPECT_EQ((constant * constant).parameters(), 0);
}

TEST(DualMatrix, BlocksKeepTheirPartials) {
  const Family a(4, 5, 10), b(2, 3, 60);
  const DualMatrix block = a.dual(at).block(1, 2, 2, 3);
  EXPECT_EQ(block.value, a.value(at).block(1, 2, 2, 3));
  EXPECT_EQ(block.d(1), a.m3.block(1, 2, 2, 3));
  DualMatrix whole(MatrixXd::Zero(4, 5));
  whole.set_block(2, 1, b.dual(at));
  EXPECT_EQ(whole.value.block(2, 1, 2, 3), b.value(at));
  EXPECT_EQ(whole.d(1).block(2, 1, 2, 3), b.m3);
  EXPECT_EQ(whole.d(1).norm(), b.m3.norm());
  EXPECT_FALSE(whole.depends_on(2));
}

TEST(DualMatrix, SolveIsTheInverseOfTheProduct) {
  const Family a(4, 4, 70), b(4, 2, 80);
  const DualMatrix x = solve(a.dual(at), b.dual(at));
  // Round-off times the condition of a 4 x 4 matrix, some tens.
  EXPECT_LT((a.value(at) * x.value - b.value(at)).norm(), 1e-13 * b.value(at).norm());
  expect_slopes([&](const VectorXd& t) { return solve(a.dual(t), b.dual(t)); });
}

// ---------------------------------------------------------------------------------------------------------------- exponential

TEST(MatrixExponential, OfAnAntisymmetricMatrixIsARotation) {
  for (const double angle : {1e-9, 0.3, 1.0, 20.0, 700.0}) {
    const MatrixXd generator = (MatrixXd(2, 2) << 0, -angle, angle, 0).finished();
    const MatrixXd rotation = (MatrixXd(2, 2) << std::cos(angle), -std::sin(angle), std::sin(angle), std::cos(angle)).finished();
    // Squaring s times amplifies round-off by 2^s, at most 4 times the angle.
    EXPECT_LT((exponential(DualMatrix(generator)).value - rotation).norm(), 4e-15 * (1 + 4 * angle)) << angle;
  }
}

TEST(MatrixExponential, OfANilpotentMatrixIsItsFiniteSeries) {
  MatrixXd shift = MatrixXd::Zero(4, 4);
  const double t = 3;
  for (Index i = 0; i < 3; ++i) shift(i, i + 1) = t;
  MatrixXd expected = MatrixXd::Identity(4, 4);
  for (Index i = 0; i < 4; ++i)
    for (Index j = i + 1; j < 4; ++j) expected(i, j) = std::pow(t, static_cast<double>(j - i)) / std::tgamma(static_cast<double>(j - i) + 1);
  EXPECT_LT((exponential(DualMatrix(shift)).value - expected).norm(), 1e-14 * expected.norm());
}

TEST(MatrixExponential, OfZeroIsTheIdentity) {
  EXPECT_EQ(exponential(DualMatrix(MatrixXd::Zero(3, 3))).value, MatrixXd(MatrixXd::Identity(3, 3)));
}

TEST(MatrixExponential, OfABadlyScaledMatrixKeepsEveryEntry) {
  // D R(angle) D^-1 with D = diag(1, 1e9): displacement in metres beside rates of a stiff mode. Relative to each entry of the result, not to the
  // largest of them. 1e9 is no power of two, so its rounding counts too.
  const double angle = 2, scale = 1e9;
  const MatrixXd generator = (MatrixXd(2, 2) << 0, -angle / scale, angle * scale, 0).finished();
  const MatrixXd e = exponential(DualMatrix(generator)).value;
  EXPECT_NEAR(e(0, 0) / std::cos(angle), 1, 1e-14);
  EXPECT_NEAR(e(0, 1) * scale / -std::sin(angle), 1, 1e-14);
  EXPECT_NEAR(e(1, 0) / scale / std::sin(angle), 1, 1e-14);
  EXPECT_NEAR(e(1, 1) / std::cos(angle), 1, 1e-14);
}

TEST(MatrixExponential, OfADiagonalMatrixWithFastDecayIsThatOfItsEntries) {
  const VectorXd rate = (VectorXd(4) << -400, -3, -1e-6, 2).finished();
  const MatrixXd e = exponential(DualMatrix(MatrixXd(rate.asDiagonal()))).value;
  for (Index i = 1; i < 4; ++i) EXPECT_NEAR(e(i, i) / std::exp(rate[i]), 1, 1e-12) << i;  // ten squarings: 2^10 times round-off
  EXPECT_LT(std::abs(e(0, 0)), 1e-16) << "what has died away stays dead";
}

TEST(MatrixExponential, OfTwiceAMatrixIsTheSquare) {
  const MatrixXd a = random_matrix(6, 6, 90);
  const MatrixXd once = exponential(DualMatrix(a)).value, twice = exponential(DualMatrix(2 * a)).value;
  EXPECT_LT((once * once - twice).norm(), 1e-13 * twice.norm());
  EXPECT_LT((once * exponential(DualMatrix(-a)).value - MatrixXd::Identity(6, 6)).norm(), 1e-12 * once.norm());
}

TEST(MatrixExponential, CarriesItsSlopes) {
  const Family a(5, 5, 100);
  expect_slopes([&](const VectorXd& t) { return exponential(a.dual(t)); });
  expect_slopes([&](const VectorXd& t) { return exponential(8 * a.dual(t)); }, 1e-4);  // with squarings
}

TEST(MatrixExponential, SlopeAlongTheMatrixItselfIsKnown) {
  // d exp(theta A) / d theta = A exp(theta A).
  const MatrixXd a = random_matrix(4, 4, 110);
  DualMatrix scaled(0.7 * a, 1);
  scaled.add_partial(0, a);
  const DualMatrix e = exponential(scaled);
  EXPECT_LT((e.d(0) - a * e.value).norm(), 1e-13 * e.d(0).norm());
}

}  // namespace
}  // namespace unrig
