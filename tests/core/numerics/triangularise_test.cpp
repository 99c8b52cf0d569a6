#include "core/numerics/triangularise.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;

MatrixXd any(Index rows, Index columns, double size = 1) {
  std::mt19937 random(static_cast<unsigned>(100 * rows + columns));
  std::normal_distribution<double> normal(0, size);
  return MatrixXd::NullaryExpr(rows, columns, [&] { return normal(random); });
}

/// A reflection keeps all products of columns, and what is left is triangular.
TEST(Triangularise, KeepsProductsAndLeavesATriangle) {
  for (const Index rows : {1, 2, 3, 7, 8, 33, 47})
    for (const Index columns : {1, 4, 6, 50})
      for (const Index pivots : {Index{0}, Index{1}, std::min(rows, columns) / 2, std::min(rows, columns), columns}) {
        const MatrixXd before = any(rows, columns);
        MatrixXd after = before;
        triangularise(after, pivots);
        const MatrixXd products = before.transpose() * before;
        EXPECT_LT((after.transpose() * after - products).norm(), 1e-13 * products.norm()) << rows << " x " << columns << ", " << pivots << " pivots";
        for (Index j = 0; j < std::min(pivots, columns); ++j)
          for (Index i = j + 1; i < rows; ++i) EXPECT_EQ(after(i, j), 0) << rows << " x " << columns << ", " << i << ' ' << j;
      }
}

TEST(Triangularise, WorksInPlaceOnAPartOfAMatrix) {
  const MatrixXd before = any(20, 9);
  MatrixXd after = before, alone = before.block(3, 1, 11, 7);
  triangularise(after.block(3, 1, 11, 7), 5);
  triangularise(alone, 5);
  EXPECT_EQ(MatrixXd(after.block(3, 1, 11, 7)), alone);
  after.block(3, 1, 11, 7) = before.block(3, 1, 11, 7);
  EXPECT_EQ(after, before) << "nothing around it";
}

TEST(Triangularise, LosesNothingOfSquaresNearTheEndsOfTheRange) {
  for (const double size : {1e-250, 1e-145, 1e145}) {
    MatrixXd large = any(9, 6), scaled = size * large;
    triangularise(large, 6);
    triangularise(scaled, 6);
    EXPECT_LT((scaled / size - large).norm(), 1e-13 * large.norm()) << size;
  }
  // Of rank one: what is left is rounding, of which the next column leaves rounding, down to the smallest numbers.
  for (const Index columns : {12, 47}) {
    MatrixXd rank_one = any(columns, 1) * any(1, columns);
    const double length = rank_one.norm();
    triangularise(rank_one, columns);
    ASSERT_TRUE(rank_one.allFinite());
    EXPECT_LT(rank_one.bottomRows(columns - 1).norm(), 1e-14 * length);
  }
  MatrixXd none = MatrixXd::Zero(5, 3);
  triangularise(none, 3);
  EXPECT_TRUE(none.isZero(0));
  MatrixXd unknown = any(5, 3);
  unknown(2, 0) = NAN;
  triangularise(unknown, 3);
  EXPECT_TRUE(unknown.row(0).array().isNaN().all()) << "what is not known does not turn into a number";
}

}  // namespace
}  // namespace unrig
