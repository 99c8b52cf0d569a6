#include "core/numerics/dual_matrix.h"

#include <Eigen/LU>
#include <cmath>

#include "core/numerics/product.h"

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;

/// Applies `combine(j)` to every parameter that either operand depends on.
template <class Combine>
std::vector<MatrixXd> merge_partials(const DualMatrix& a, const DualMatrix& b, Combine combine) {
  const Index parameters = std::max(a.parameters(), b.parameters());
  std::vector<MatrixXd> merged(static_cast<std::size_t>(parameters));
  for (Index j = 0; j < parameters; ++j)
    if (a.depends_on(j) || b.depends_on(j)) merged[static_cast<std::size_t>(j)] = combine(j);
  return merged;
}

/// Powers of two d with D^-1 |A| D nearly equal in its row and column norms (Parlett and Reinsch 1969): mixed units otherwise make the norm,
/// and with it the number of squarings, needlessly large. Powers of two, so that scaling is exact.
Eigen::VectorXd balancing(MatrixXd magnitude) {
  const Index n = magnitude.rows();
  Eigen::VectorXd scale = Eigen::VectorXd::Ones(n);
  magnitude.diagonal().setZero();
  constexpr int sweeps = 8;
  for (int sweep = 0; sweep < sweeps; ++sweep)
    for (Index i = 0; i < n; ++i) {
      const double column = magnitude.col(i).sum(), row = magnitude.row(i).sum();
      if (column == 0 || row == 0) continue;
      const double factor = std::exp2(std::round(0.5 * std::log2(row / column)));
      scale[i] *= factor;
      magnitude.col(i) *= factor;
      magnitude.row(i) /= factor;
    }
  return scale;
}

/// D^-1 A D, or its inverse with `scale.cwiseInverse()`, applied to value and partials.
DualMatrix rescaled(const DualMatrix& a, const Eigen::VectorXd& scale) {
  const auto apply = [&](const MatrixXd& m) -> MatrixXd { return scale.cwiseInverse().asDiagonal() * m * scale.asDiagonal(); };
  DualMatrix result(apply(a.value), a.parameters());
  for (Index j = 0; j < a.parameters(); ++j)
    if (a.depends_on(j)) result.partial[static_cast<std::size_t>(j)] = apply(a.d(j));
  return result;
}

}  // namespace

void DualMatrix::add_partial(Index j, const MatrixXd& change) {
  MatrixXd& target = partial.at(static_cast<std::size_t>(j));
  if (target.size() == 0)
    target = change;
  else
    target += change;
}

DualMatrix DualMatrix::block(Index row, Index col, Index rows, Index cols) const {
  DualMatrix part(value.block(row, col, rows, cols), parameters());
  for (Index j = 0; j < parameters(); ++j)
    if (depends_on(j)) part.partial[static_cast<std::size_t>(j)] = d(j).block(row, col, rows, cols);
  return part;
}

DualMatrix DualMatrix::grown(Index rows, Index cols) const {
  DualMatrix larger(MatrixXd::Zero(rows, cols), parameters());
  larger.set_block(0, 0, *this);
  return larger;
}

void DualMatrix::set_block(Index row, Index col, const DualMatrix& part) {
  value.block(row, col, part.rows(), part.cols()) = part.value;
  if (part.parameters() > parameters()) partial.resize(part.partial.size());
  for (Index j = 0; j < part.parameters(); ++j) {
    if (!part.depends_on(j)) continue;
    MatrixXd& target = partial[static_cast<std::size_t>(j)];
    if (target.size() == 0) target.setZero(rows(), cols());
    target.block(row, col, part.rows(), part.cols()) = part.d(j);
  }
}

DualMatrix operator+(const DualMatrix& a, const DualMatrix& b) {
  DualMatrix sum(a.value + b.value);
  sum.partial = merge_partials(a, b, [&](Index j) -> MatrixXd {
    if (!a.depends_on(j)) return b.d(j);
    return b.depends_on(j) ? MatrixXd(a.d(j) + b.d(j)) : a.d(j);
  });
  return sum;
}

DualMatrix operator*(double factor, const DualMatrix& a) {
  DualMatrix scaled = a;
  scaled.value *= factor;
  for (MatrixXd& partial : scaled.partial) partial *= factor;
  return scaled;
}

DualMatrix operator-(const DualMatrix& a, const DualMatrix& b) { return a + (-1.0) * b; }

DualMatrix operator*(const DualMatrix& a, const DualMatrix& b) {
  DualMatrix result(product(a.value, b.value));
  result.partial = merge_partials(a, b, [&](Index j) -> MatrixXd {
    if (!a.depends_on(j)) return product(a.value, b.d(j));
    MatrixXd d = product(a.d(j), b.value);
    if (b.depends_on(j)) add_product(a.value, b.d(j), d);
    return d;
  });
  return result;
}

DualMatrix operator*(const MatrixXd& constant, const DualMatrix& a) { return DualMatrix(constant) * a; }

DualMatrix solve(const DualMatrix& a, const DualMatrix& b) {
  const Eigen::PartialPivLU<MatrixXd> lu(a.value);
  DualMatrix x(lu.solve(b.value));
  x.partial = merge_partials(a, b, [&](Index j) -> MatrixXd {
    MatrixXd right = b.depends_on(j) ? b.d(j) : MatrixXd::Zero(b.rows(), b.cols());
    if (a.depends_on(j)) right.noalias() -= a.d(j) * x.value;
    return lu.solve(right);
  });
  return x;
}

DualMatrix exponential(const DualMatrix& a) {
  const Eigen::VectorXd scale = balancing(a.value.cwiseAbs());
  const DualMatrix balanced = rescaled(a, scale);

  constexpr double largest_scaled_norm = 0.25;
  const double norm = balanced.value.cwiseAbs().colwise().sum().maxCoeff();
  const int squarings = norm > largest_scaled_norm ? static_cast<int>(std::ceil(std::log2(norm / largest_scaled_norm))) : 0;
  const DualMatrix x = std::exp2(-squarings) * balanced;

  // Paterson-Stockmeyer: sum_{k=0}^{12} x^k / k! in blocks of three with powers x, x^2, x^3: five products instead of eleven.
  const DualMatrix x2 = x * x, x3 = x2 * x;
  double factorial[13];
  factorial[0] = 1;
  for (int k = 1; k <= 12; ++k) factorial[k] = factorial[k - 1] * k;
  const auto block = [&](int first) {
    DualMatrix sum = (1 / factorial[first + 1]) * x + (1 / factorial[first + 2]) * x2;
    sum.value.diagonal().array() += 1 / factorial[first];
    return sum;
  };
  DualMatrix e = block(9) + (1 / factorial[12]) * x3;
  for (int first = 6; first >= 0; first -= 3) e = block(first) + x3 * e;

  for (int s = 0; s < squarings; ++s) e = e * e;
  return rescaled(e, scale.cwiseInverse());
}

}  // namespace unrig
