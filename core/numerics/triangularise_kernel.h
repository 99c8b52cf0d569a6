#pragma once
#include <cmath>
#include <cstddef>

// triangularise, for whatever vectors the including file is compiled for. It may hold nothing that another file would share: the linker would keep one of them.

namespace {

/// C columns of `length` numbers, less `tau` (reflector . column) times the reflector.
template <int W, int C>
[[gnu::always_inline]] inline void reflect_columns(const double* reflector, std::ptrdiff_t length, double tau, double* a, std::ptrdiff_t stride) {
  typedef double Vector __attribute__((vector_size(8 * W), aligned(8), may_alias));
  const std::ptrdiff_t whole = length / W * W;
  Vector sums[C] = {};
  double dot[C] = {};
  for (std::ptrdiff_t i = 0; i < whole; i += W)
    for (int c = 0; c < C; ++c) sums[c] += *reinterpret_cast<const Vector*>(reflector + i) * *reinterpret_cast<const Vector*>(a + c * stride + i);
  for (std::ptrdiff_t i = whole; i < length; ++i)
    for (int c = 0; c < C; ++c) dot[c] += reflector[i] * a[c * stride + i];
  for (int c = 0; c < C; ++c) {
    double lanes[W];
    *reinterpret_cast<Vector*>(lanes) = sums[c];
    for (int w = 0; w < W; ++w) dot[c] += lanes[w];
    dot[c] *= tau;
  }
  for (std::ptrdiff_t i = 0; i < whole; i += W)
    for (int c = 0; c < C; ++c) *reinterpret_cast<Vector*>(a + c * stride + i) -= dot[c] * *reinterpret_cast<const Vector*>(reflector + i);
  for (std::ptrdiff_t i = whole; i < length; ++i)
    for (int c = 0; c < C; ++c) a[c * stride + i] -= dot[c] * reflector[i];
}

/// Without overflow; NaN where there is one.
template <int W>
[[gnu::always_inline]] inline double length_of(const double* a, std::ptrdiff_t length) {
  typedef double Vector __attribute__((vector_size(8 * W), aligned(8), may_alias));
  const std::ptrdiff_t whole = length / W * W;
  Vector sums = {};
  double lanes[W], squares = 0;
  for (std::ptrdiff_t i = 0; i < whole; i += W) sums += *reinterpret_cast<const Vector*>(a + i) * *reinterpret_cast<const Vector*>(a + i);
  for (std::ptrdiff_t i = whole; i < length; ++i) squares += a[i] * a[i];
  *reinterpret_cast<Vector*>(lanes) = sums;
  for (int w = 0; w < W; ++w) squares += lanes[w];
  constexpr double small = 1e-280, large = 1e280;
  if (squares > small && squares < large) return std::sqrt(squares);
  double largest = 0, scaled = 0;
  for (std::ptrdiff_t i = 0; i < length; ++i) largest = std::fmax(largest, std::fabs(a[i]));
  if (!(largest > 0)) return squares;
  for (std::ptrdiff_t i = 0; i < length; ++i) scaled += a[i] / largest * (a[i] / largest);
  return largest * std::sqrt(scaled);
}

template <int W>
[[gnu::always_inline]] inline void triangularise_columns(double* a, std::ptrdiff_t rows, std::ptrdiff_t columns, std::ptrdiff_t stride, std::ptrdiff_t pivots) {
  for (std::ptrdiff_t j = 0; j < pivots && j + 1 < rows; ++j) {
    double* below = a + j * stride + j;
    const std::ptrdiff_t length = rows - j;
    constexpr double nothing = 1e-290;  // beneath it numbers lose digits; rounding of what cancels, and of the rounding itself, gets there
    const double size = length_of<W>(below, length);
    if (size <= nothing) {
      for (std::ptrdiff_t i = 1; i < length; ++i) below[i] = 0;
      continue;
    }
    // The reflector, in the place of what it takes away, with one in front: then no number is near the square of another.
    const double end = below[0] > 0 ? -size : size, front = below[0] - end, tau = -front / end;
    below[0] = 1;
    for (std::ptrdiff_t i = 1; i < length; ++i) below[i] /= front;
    std::ptrdiff_t k = j + 1;
    for (; k + 4 <= columns; k += 4) reflect_columns<W, 4>(below, length, tau, a + k * stride + j, stride);
    for (; k < columns; ++k) reflect_columns<W, 1>(below, length, tau, a + k * stride + j, stride);
    below[0] = end;
    for (std::ptrdiff_t i = 1; i < length; ++i) below[i] = 0;
  }
}

}  // namespace
