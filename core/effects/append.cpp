#include "core/effects/effect.h"

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;

/// `a` in the top left of a larger matrix of zeros, with its partials.
DualMatrix grown(const DualMatrix& a, Index rows, Index cols) {
  DualMatrix larger(MatrixXd::Zero(rows, cols), a.parameters());
  larger.set_block(0, 0, a);
  return larger;
}

DualMatrix columns_of(const DualMatrix& a, const std::vector<Index>& columns) {
  DualMatrix picked(MatrixXd(a.rows(), static_cast<Index>(columns.size())), a.parameters());
  for (std::size_t i = 0; i < columns.size(); ++i) picked.set_block(0, static_cast<Index>(i), a.block(0, columns[i], a.rows(), 1));
  return picked;
}

Index append(LinearSystem& system, const DualMatrix& F) {
  const Index n = system.states(), k = F.rows();
  system.A = grown(system.A, n + k, n + k);
  system.A.set_block(n, n, F);
  system.B = grown(system.B, n + k, system.B.cols());
  system.C = grown(system.C, system.C.rows(), n + k);
  for (Index i = 0; i < k; ++i) system.exogenous.push_back(n + i);
  return n;
}

}  // namespace

Index append_signal(LinearSystem& system, const DualMatrix& F, const std::vector<Index>& columns, const DualMatrix& H) {
  const DualMatrix push = columns_of(system.B, columns) * H, direct = columns_of(system.D, columns) * H;
  const Index first = append(system, F);
  system.A.set_block(0, first, push);
  system.C.set_block(0, first, direct);
  return first;
}

Index append_reading(LinearSystem& system, const DualMatrix& F, Index row, const DualMatrix& H) {
  const Index first = append(system, F);
  system.C.set_block(row, first, H);
  return first;
}

}  // namespace unrig
