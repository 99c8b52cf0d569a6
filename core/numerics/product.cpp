#include "core/numerics/product.h"

#include "core/numerics/small_product_tiles.h"

namespace unrig {

#ifdef UNRIG_WIDE_VECTORS
void product_avx2(const double* a, std::ptrdiff_t a_stride, std::ptrdiff_t rows, std::ptrdiff_t inner, const double* b, std::ptrdiff_t b_stride, std::ptrdiff_t columns, double* c,
                  bool add);  // product_avx2.cpp
#endif

namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Matrix = Eigen::Ref<const MatrixXd>;

/// The left factor is read anew for every four columns. Up to 181 rows and columns that is twice as fast as Eigen's blocks in narrow vectors; at 600, far beyond the cache, no longer.
bool suits_tiles(const Matrix& a, const Matrix& b) {
  constexpr Index cached = 32768;  // numbers, 256 kB
  return a.size() > 0 && a.size() <= cached && b.cols() > 1;  // Eigen knows what to do with nothing
}

void multiply(const Matrix& a, const Matrix& b, MatrixXd& c, bool add) {
#ifdef UNRIG_WIDE_VECTORS
  static const bool wide = __builtin_cpu_supports("avx2");
  if (wide) return product_avx2(a.data(), a.outerStride(), a.rows(), a.cols(), b.data(), b.outerStride(), b.cols(), c.data(), add);
#endif
  if (add) all_stripes<2, Result::is_added>(a.data(), a.outerStride(), a.rows(), a.cols(), b.data(), b.outerStride(), b.cols(), c.data(), c.rows());
  else all_stripes<2>(a.data(), a.outerStride(), a.rows(), a.cols(), b.data(), b.outerStride(), b.cols(), c.data(), c.rows());
}

}  // namespace

MatrixXd product(const Matrix& a, const Matrix& b) {
  MatrixXd c(a.rows(), b.cols());
  set_product(a, b, c);
  return c;
}

void set_product(const Matrix& a, const Matrix& b, MatrixXd& c) {
  eigen_assert(a.cols() == b.rows() && c.rows() == a.rows() && c.cols() == b.cols());
  if (suits_tiles(a, b)) multiply(a, b, c, false);
  else c.noalias() = a * b;
}

void add_product(const Matrix& a, const Matrix& b, MatrixXd& c) {
  eigen_assert(a.cols() == b.rows() && c.rows() == a.rows() && c.cols() == b.cols());
  if (suits_tiles(a, b)) multiply(a, b, c, true);
  else c.noalias() += a * b;
}

}  // namespace unrig
