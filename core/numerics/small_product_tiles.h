#pragma once
#include <cstddef>

// small_product, for whatever vectors the including file is compiled for. It may hold nothing that another file would share: the linker would keep one of them.

namespace {

/// R vectors of W rows, and C columns, of the product, held in registers.
template <int W, int R, int C>
[[gnu::always_inline]] inline void tile(const double* a, std::ptrdiff_t rows, std::ptrdiff_t inner, const double* b, std::ptrdiff_t b_stride, double* c, std::ptrdiff_t c_stride) {
  typedef double Vector __attribute__((vector_size(8 * W), aligned(8), may_alias));
  Vector sum[R][C] = {};
  for (std::ptrdiff_t k = 0; k < inner; ++k) {
    const Vector* column = reinterpret_cast<const Vector*>(a + k * rows);
    for (int j = 0; j < C; ++j)
      for (int i = 0; i < R; ++i) sum[i][j] += column[i] * b[j * b_stride + k];
  }
  for (int j = 0; j < C; ++j)
    for (int i = 0; i < R; ++i) reinterpret_cast<Vector*>(c + j * c_stride)[i] = sum[i][j];
}

/// All rows of C columns.
template <int W, int R, int C>
[[gnu::always_inline]] inline void stripe(const double* a, std::ptrdiff_t rows, std::ptrdiff_t inner, const double* b, std::ptrdiff_t b_stride, double* c, std::ptrdiff_t c_stride) {
  std::ptrdiff_t row = 0;
  for (; row + W * R <= rows; row += W * R) tile<W, R, C>(a + row, rows, inner, b, b_stride, c + row, c_stride);
  for (; row < rows; row += W) tile<W, 1, C>(a + row, rows, inner, b, b_stride, c + row, c_stride);
}

template <int W>
[[gnu::always_inline]] inline void all_stripes(const double* a, std::ptrdiff_t rows, std::ptrdiff_t inner, const double* b, std::ptrdiff_t b_stride, std::ptrdiff_t columns, double* c,
                                               std::ptrdiff_t c_stride) {
  std::ptrdiff_t column = 0;
  for (; column + 4 <= columns; column += 4) stripe<W, 3, 4>(a, rows, inner, b + column * b_stride, b_stride, c + column * c_stride, c_stride);
  for (; column < columns; ++column) stripe<W, 7, 1>(a, rows, inner, b + column * b_stride, b_stride, c + column * c_stride, c_stride);
}

}  // namespace
