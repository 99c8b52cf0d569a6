// Compiled for wider vectors than the rest of the library (core/CMakeLists.txt). Eigen's templates depend on their width: in a namespace of another name the linker cannot take these for the others.
#define Eigen EigenInWideVectors
#include "core/numerics/householder_kernels.h"

namespace unrig {

void factorise_avx2(double* a, std::ptrdiff_t rows, std::ptrdiff_t columns, double* coefficients);
void reflect_avx2(const double* factors, std::ptrdiff_t rows, std::ptrdiff_t columns, const double* coefficients, double* b, std::ptrdiff_t b_columns);

void factorise_avx2(double* a, std::ptrdiff_t rows, std::ptrdiff_t columns, double* coefficients) { factorise(a, rows, columns, coefficients); }

void reflect_avx2(const double* factors, std::ptrdiff_t rows, std::ptrdiff_t columns, const double* coefficients, double* b, std::ptrdiff_t b_columns) {
  reflect(factors, rows, columns, coefficients, b, b_columns);
}

}  // namespace unrig
