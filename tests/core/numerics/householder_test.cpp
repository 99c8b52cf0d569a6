#include "core/numerics/householder.h"

#include <gtest/gtest.h>

#include "core/numerics/householder_kernels.h"

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double rounding = 1e-13;  // some hundred operations a number, each to 1e-16

/// Q^T A = R, Q keeps lengths, and both widths of vectors do the same arithmetic but for its order: shapes with and without blocks of reflections, taller and wider than square.
TEST(Householder, RotatesIntoATriangleInEitherWidth) {
  for (const auto& [rows, columns] : {std::pair<Index, Index>{7, 3}, {200, 5}, {300, 120}, {4, 9}, {1, 1}}) {
    const MatrixXd a = MatrixXd::Random(rows, columns), b = MatrixXd::Random(rows, 60);
    const Householder qr(a);
    const Index kept = std::min(rows, columns);
    const MatrixXd rotated = qr.rotated(a);
    EXPECT_LT((rotated.topRows(kept) - qr.triangle()).norm(), rounding * a.norm()) << rows << " x " << columns;
    EXPECT_LT(rotated.bottomRows(rows - kept).norm(), rounding * a.norm());
    EXPECT_LT((qr.rotated(b).transpose() * qr.rotated(b) - b.transpose() * b).norm(), rounding * b.squaredNorm());

    MatrixXd narrow = a, narrow_b = b;
    VectorXd coefficients(kept);
    factorise(narrow.data(), rows, columns, coefficients.data());
    reflect(narrow.data(), rows, columns, coefficients.data(), narrow_b.data(), b.cols());
    EXPECT_LT((narrow - qr.factors()).norm(), rounding * a.norm());
    EXPECT_LT((narrow_b - qr.rotated(b)).norm(), rounding * b.norm());
  }
}

TEST(Householder, NothingIsNoMatrix) {
  EXPECT_EQ(Householder(MatrixXd(5, 0)).triangle().size(), 0);
  const MatrixXd b = MatrixXd::Random(5, 2);
  EXPECT_EQ(Householder(MatrixXd(5, 0)).rotated(b), b);
}

}  // namespace
}  // namespace unrig
