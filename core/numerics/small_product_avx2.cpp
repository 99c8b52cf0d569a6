// Compiled for wider vectors than the rest of the library (core/CMakeLists.txt), and therefore without Eigen, whose memory layout depends on them.
#include "core/numerics/small_product_tiles.h"

namespace unrig {

void small_product_avx2(const double* a, std::ptrdiff_t rows, std::ptrdiff_t inner, const double* b, std::ptrdiff_t b_stride, std::ptrdiff_t columns, double* c,
                        std::ptrdiff_t c_stride);

void small_product_avx2(const double* a, std::ptrdiff_t rows, std::ptrdiff_t inner, const double* b, std::ptrdiff_t b_stride, std::ptrdiff_t columns, double* c, std::ptrdiff_t c_stride) {
  all_stripes<4>(a, rows, rows, inner, b, b_stride, columns, c, c_stride);
}

}  // namespace unrig
