#include "core/numerics/small_product.h"

#include <gtest/gtest.h>

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;

TEST(SmallProduct, IsTheProductForEveryShape) {
  for (const Index rows : {1, 4, 5, 12, 13, 27, 28, 29, 63})
    for (const Index inner : {1, 2, 7, 30})
      for (const Index columns : {0, 1, 3, 4, 5, 9}) {
        MatrixXd a = MatrixXd::Zero(padded_rows(rows), inner);
        a.topRows(rows) = MatrixXd::Random(rows, inner);
        const MatrixXd b = MatrixXd::Random(inner + 3, columns);  // strides beyond what is read
        MatrixXd c = MatrixXd::Constant(a.rows() + 2, columns, 7);
        small_product(a.data(), a.rows(), inner, b.data(), b.rows(), columns, c.data(), c.rows());
        const MatrixXd expected = a * b.topRows(inner);
        // Sums of up to 30 products of numbers below one.
        EXPECT_LE((c.topRows(a.rows()) - expected).cwiseAbs().sum(), 1e-14 * static_cast<double>(inner * a.rows() * columns)) << rows << " " << inner << " " << columns;
        EXPECT_TRUE((c.bottomRows(2).array() == 7).all()) << "nothing is written beside the product";
      }
}

}  // namespace
}  // namespace unrig
