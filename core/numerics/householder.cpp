#include "core/numerics/householder.h"

#include <algorithm>
#include <utility>

#include "core/numerics/householder_kernels.h"
#include "core/numerics/work.h"

namespace unrig {

#ifdef UNRIG_WIDE_VECTORS
void factorise_avx2(double* a, std::ptrdiff_t rows, std::ptrdiff_t columns, double* coefficients);  // householder_avx2.cpp
void reflect_avx2(const double* factors, std::ptrdiff_t rows, std::ptrdiff_t columns, const double* coefficients, double* b, std::ptrdiff_t b_columns);

namespace {

bool wide() {
  static const bool has = __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma");
  return has;
}

}  // namespace
#endif

Householder::Householder(Eigen::MatrixXd a) : factors_(std::move(a)), coefficients_(std::min(factors_.rows(), factors_.cols())) {
  if (factors_.size() == 0) return;
  count_work(rows() * coefficients_.size() * (2 * cols() - coefficients_.size()));
#ifdef UNRIG_WIDE_VECTORS
  if (wide()) {
    factorise_avx2(factors_.data(), rows(), cols(), coefficients_.data());
    return;
  }
#endif
  factorise(factors_.data(), rows(), cols(), coefficients_.data());
}

Eigen::MatrixXd Householder::triangle() const { return factors_.topRows(coefficients_.size()).triangularView<Eigen::Upper>(); }

Eigen::MatrixXd Householder::rotated(Eigen::MatrixXd b) const {
  if (b.size() == 0 || factors_.size() == 0) return b;
  count_work(2 * rows() * coefficients_.size() * b.cols());
#ifdef UNRIG_WIDE_VECTORS
  if (wide()) {
    reflect_avx2(factors_.data(), rows(), cols(), coefficients_.data(), b.data(), b.cols());
    return b;
  }
#endif
  reflect(factors_.data(), rows(), cols(), coefficients_.data(), b.data(), b.cols());
  return b;
}

}  // namespace unrig
