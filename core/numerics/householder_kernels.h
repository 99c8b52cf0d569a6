#pragma once
#include <Eigen/QR>
#include <cstddef>

// The arithmetic of core/numerics/householder.h, once for each width of vectors. Matrices are stored column by column, without gaps.

namespace unrig {
namespace {  // every translation unit has its own

void factorise(double* a, std::ptrdiff_t rows, std::ptrdiff_t columns, double* coefficients) {
  Eigen::Map<Eigen::MatrixXd> matrix(a, rows, columns);
  Eigen::Ref<Eigen::MatrixXd> in_place(matrix);
  const Eigen::HouseholderQR<Eigen::Ref<Eigen::MatrixXd>> qr(in_place);
  Eigen::Map<Eigen::VectorXd>(coefficients, qr.hCoeffs().size()) = qr.hCoeffs();
}

void reflect(const double* factors, std::ptrdiff_t rows, std::ptrdiff_t columns, const double* coefficients, double* b, std::ptrdiff_t b_columns) {
  const std::ptrdiff_t length = rows < columns ? rows : columns;
  const Eigen::Map<const Eigen::MatrixXd> vectors(factors, rows, columns);
  const Eigen::Map<const Eigen::VectorXd> tau(coefficients, length);
  Eigen::Map<Eigen::MatrixXd>(b, rows, b_columns).applyOnTheLeft(Eigen::householderSequence(vectors, tau).setLength(length).adjoint());
}

}  // namespace
}  // namespace unrig
