#pragma once
#include <cstddef>

// small_product and product, for whatever vectors the including file is compiled for. It may hold nothing that another file would share: the linker would keep one of them.

namespace {

enum class Result { is_set, is_added };

/// R vectors of W rows, and C columns, of the product, held in registers.
template <int W, int R, int C, Result result>
[[gnu::always_inline]] inline void tile(const double* a, std::ptrdiff_t a_stride, std::ptrdiff_t inner, const double* b, std::ptrdiff_t b_stride, double* c, std::ptrdiff_t c_stride) {
  typedef double Vector __attribute__((vector_size(8 * W), aligned(8), may_alias));
  Vector sum[R][C] = {};
  for (std::ptrdiff_t k = 0; k < inner; ++k) {
    const Vector* column = reinterpret_cast<const Vector*>(a + k * a_stride);
    for (int j = 0; j < C; ++j)
      for (int i = 0; i < R; ++i) sum[i][j] += column[i] * b[j * b_stride + k];
  }
  for (int j = 0; j < C; ++j)
    for (int i = 0; i < R; ++i) {
      Vector& there = reinterpret_cast<Vector*>(c + j * c_stride)[i];
      there = result == Result::is_added ? there + sum[i][j] : sum[i][j];
    }
}

/// One row.
template <Result result>
[[gnu::always_inline]] inline void row_by_itself(const double* a, std::ptrdiff_t a_stride, std::ptrdiff_t inner, const double* b, std::ptrdiff_t b_stride, std::ptrdiff_t columns, double* c, std::ptrdiff_t c_stride) {
  for (std::ptrdiff_t j = 0; j < columns; ++j) {
    double sum = 0;
    for (std::ptrdiff_t k = 0; k < inner; ++k) sum += a[k * a_stride] * b[j * b_stride + k];
    c[j * c_stride] = result == Result::is_added ? c[j * c_stride] + sum : sum;
  }
}

/// All rows of C columns, but for the last where their number is odd; returns how many were done.
template <int W, int R, int C, Result result>
[[gnu::always_inline]] inline std::ptrdiff_t stripe(const double* a, std::ptrdiff_t a_stride, std::ptrdiff_t rows, std::ptrdiff_t inner, const double* b, std::ptrdiff_t b_stride, double* c, std::ptrdiff_t c_stride) {
  std::ptrdiff_t row = 0;
  for (; row + W * R <= rows; row += W * R) tile<W, R, C, result>(a + row, a_stride, inner, b, b_stride, c + row, c_stride);
  for (; row + W <= rows; row += W) tile<W, 1, C, result>(a + row, a_stride, inner, b, b_stride, c + row, c_stride);
  if constexpr (W > 2)
    for (; row + 2 <= rows; row += 2) tile<2, 1, C, result>(a + row, a_stride, inner, b, b_stride, c + row, c_stride);
  return row;
}

template <int W, Result result = Result::is_set>
[[gnu::always_inline]] inline void all_stripes(const double* a, std::ptrdiff_t a_stride, std::ptrdiff_t rows, std::ptrdiff_t inner, const double* b, std::ptrdiff_t b_stride, std::ptrdiff_t columns, double* c,
                                               std::ptrdiff_t c_stride) {
  std::ptrdiff_t column = 0, row = 0;
  for (; column + 4 <= columns; column += 4) row = stripe<W, 3, 4, result>(a, a_stride, rows, inner, b + column * b_stride, b_stride, c + column * c_stride, c_stride);
  for (; column < columns; ++column) row = stripe<W, 7, 1, result>(a, a_stride, rows, inner, b + column * b_stride, b_stride, c + column * c_stride, c_stride);
  for (; row < rows && columns > 0; ++row) row_by_itself<result>(a + row, a_stride, inner, b, b_stride, columns, c + row, c_stride);
}

}  // namespace
