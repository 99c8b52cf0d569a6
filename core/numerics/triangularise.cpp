#include "core/numerics/triangularise.h"

#include "core/numerics/triangularise_kernel.h"
#include "core/numerics/work.h"

namespace unrig {

#ifdef UNRIG_WIDE_VECTORS
void triangularise_avx2(double* a, std::ptrdiff_t rows, std::ptrdiff_t columns, std::ptrdiff_t stride, std::ptrdiff_t pivots);  // triangularise_avx2.cpp
#endif

void triangularise(Eigen::Ref<Eigen::MatrixXd> rows, Eigen::Index pivots) {
  count_work(rows.rows() * pivots * (2 * rows.cols() - pivots));
#ifdef UNRIG_WIDE_VECTORS
  static const bool wide = __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma");
  if (wide) return triangularise_avx2(rows.data(), rows.rows(), rows.cols(), rows.outerStride(), pivots);
#endif
  triangularise_columns<2>(rows.data(), rows.rows(), rows.cols(), rows.outerStride(), pivots);
}

}  // namespace unrig
