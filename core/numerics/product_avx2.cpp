// Compiled for wider vectors than the rest of the library (core/CMakeLists.txt), and therefore without Eigen, whose memory layout depends on them.
#include "core/numerics/small_product_tiles.h"

namespace unrig {

void product_avx2(const double* a, std::ptrdiff_t a_stride, std::ptrdiff_t rows, std::ptrdiff_t inner, const double* b, std::ptrdiff_t b_stride, std::ptrdiff_t columns, double* c, bool add);

void product_avx2(const double* a, std::ptrdiff_t a_stride, std::ptrdiff_t rows, std::ptrdiff_t inner, const double* b, std::ptrdiff_t b_stride, std::ptrdiff_t columns, double* c, bool add) {
  if (add) all_stripes<4, Result::is_added>(a, a_stride, rows, inner, b, b_stride, columns, c, rows);
  else all_stripes<4>(a, a_stride, rows, inner, b, b_stride, columns, c, rows);
}

}  // namespace unrig
