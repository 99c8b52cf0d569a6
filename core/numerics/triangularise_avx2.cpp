// Compiled for wider vectors than the rest of the library (core/CMakeLists.txt), and therefore without Eigen, whose memory layout depends on them.
#include "core/numerics/triangularise_kernel.h"

namespace unrig {

void triangularise_avx2(double* a, std::ptrdiff_t rows, std::ptrdiff_t columns, std::ptrdiff_t stride, std::ptrdiff_t pivots);

void triangularise_avx2(double* a, std::ptrdiff_t rows, std::ptrdiff_t columns, std::ptrdiff_t stride, std::ptrdiff_t pivots) { triangularise_columns<4>(a, rows, columns, stride, pivots); }

}  // namespace unrig
