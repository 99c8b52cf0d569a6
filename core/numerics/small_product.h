#pragma once
#include <Eigen/Core>

namespace unrig {

/// Rows of a small_product: `rows` and what fills them up to whole groups of four.
constexpr Eigen::Index padded_rows(Eigen::Index rows) { return (rows + 3) / 4 * 4; }

/// c = a b for a matrix `a` of some ten rows and columns that is met at every sample, where a library's preparations cost more than the arithmetic.
/// All three are stored column by column: `a` padded_rows x inner, without gaps; `b` inner x columns; `c` padded_rows x columns; the strides are from one
/// column to the next. `c` must not overlap the others.
void small_product(const double* a, Eigen::Index padded_rows, Eigen::Index inner, const double* b, Eigen::Index b_stride, Eigen::Index columns, double* c,
                   Eigen::Index c_stride);

}  // namespace unrig
