#include "core/numerics/product.h"

#include <gtest/gtest.h>

#include <array>

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;

/// In the order of the inner index.
MatrixXd one_after_the_other(const MatrixXd& a, const MatrixXd& b) {
  MatrixXd c = MatrixXd::Zero(a.rows(), b.cols());
  for (Index i = 0; i < c.rows(); ++i)
    for (Index j = 0; j < c.cols(); ++j)
      for (Index k = 0; k < a.cols(); ++k) c(i, j) += a(i, k) * b(k, j);
  return c;
}

TEST(Product, HasTheDigitsOfOneSumAfterTheOther) {
#ifndef __x86_64__
  GTEST_SKIP() << "other compilers and processors may round a product and a sum at once";
#endif
  for (const Index rows : {1, 2, 3, 4, 5, 7, 12, 13, 30, 63})
    for (const Index inner : {1, 2, 7, 30, 300})
      for (const Index columns : {2, 3, 4, 5, 9, 40}) {
        const MatrixXd larger = MatrixXd::Random(rows + 3, inner + 2), b = MatrixXd::Random(inner + 1, columns);
        const auto within = larger.block(2, 1, rows, inner);  // strides beyond what is read
        const MatrixXd wanted = one_after_the_other(within, b.topRows(inner));
        EXPECT_EQ(product(within, b.topRows(inner)), wanted) << rows << " " << inner << " " << columns;
        const MatrixXd before = MatrixXd::Random(rows, columns);
        MatrixXd sum = before;
        add_product(within, b.topRows(inner), sum);
        EXPECT_EQ(sum, before + wanted) << rows << " " << inner << " " << columns;
        set_product(within, b.topRows(inner), sum);
        EXPECT_EQ(sum, wanted) << rows << " " << inner << " " << columns;
      }
}

TEST(Product, IsThatOfEigenWhereItIsLargeAVectorOrEmpty) {
  for (const auto& [rows, inner, columns] : {std::array<Index, 3>{400, 300, 7}, {20, 30, 1}, {0, 3, 4}, {4, 3, 0}, {5, 0, 6}}) {
    const MatrixXd a = MatrixXd::Random(rows, inner), b = MatrixXd::Random(inner, columns);
    const MatrixXd found = product(a, b);
    ASSERT_EQ(found.rows(), rows);
    ASSERT_EQ(found.cols(), columns);
    EXPECT_LE((found - a * b).cwiseAbs().sum(), 1e-14 * static_cast<double>(1 + inner * rows * columns)) << rows << " " << inner << " " << columns;  // sums of up to 300 products of numbers below one
  }
}

}  // namespace
}  // namespace unrig
