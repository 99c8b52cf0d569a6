#include "core/numerics/small_product.h"

#include "core/numerics/small_product_tiles.h"
#include "core/numerics/work.h"

namespace unrig {

#ifdef UNRIG_WIDE_VECTORS
void small_product_avx2(const double* a, std::ptrdiff_t rows, std::ptrdiff_t inner, const double* b, std::ptrdiff_t b_stride, std::ptrdiff_t columns, double* c,
                        std::ptrdiff_t c_stride);  // small_product_avx2.cpp
#endif

void small_product(const double* a, Eigen::Index padded_rows, Eigen::Index inner, const double* b, Eigen::Index b_stride, Eigen::Index columns, double* c, Eigen::Index c_stride) {
  count_work(padded_rows * inner * columns);
#ifdef UNRIG_WIDE_VECTORS
  static const bool wide = __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma");
  if (wide) return small_product_avx2(a, padded_rows, inner, b, b_stride, columns, c, c_stride);
#endif
  all_stripes<2>(a, padded_rows, padded_rows, inner, b, b_stride, columns, c, c_stride);
}

}  // namespace unrig
