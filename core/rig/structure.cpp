#include "core/rig/structure.h"

#include <Eigen/Eigenvalues>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include <fmt/format.h>

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Torsion element (from 0) that carries normal element i.
Index carrier(const Rig& rig, Index i) { return std::min<Index>(i, rig.rigid_from - 1); }

Index modes_below(const VectorXd& omega, double hertz) {
  return (omega.array() < 2 * std::numbers::pi * hertz).count();
}

/// Whether two lists of frequencies agree below `nyquist` to one part in a thousand.
bool agree_below(const VectorXd& coarse, const VectorXd& fine, double nyquist) {
  for (Index i = 0; i < coarse.size(); ++i) {
    if (fine[i] > nyquist) return true;
    if (std::abs(coarse[i] - fine[i]) > 1e-3 * fine[i]) return false;
  }
  return true;
}

Index wanted_torsion_modes(const Rig& rig, const Modes& torsion, double nyquist) {
  const Index wanted = rig.torsion.modes > 0 ? rig.torsion.modes : std::max<Index>(1, modes_below(torsion.omega, nyquist));
  return std::min(wanted, torsion.omega.size());
}

}  // namespace

Modes chain_modes(const Chain& chain) {
  const VectorXd root = chain.inertia.cwiseSqrt();
  const Eigen::SelfAdjointEigenSolver<MatrixXd> eigen(root.asDiagonal() * chain.flexibility * root.asDiagonal());
  const VectorXd lambda = eigen.eigenvalues().reverse();  // 1 / omega^2, largest first
  const Index kept = (lambda.array() > 1e-9 * lambda[0]).count();
  Modes modes;
  modes.omega = lambda.head(kept).cwiseSqrt().cwiseInverse();
  modes.shape = root.cwiseInverse().asDiagonal() * eigen.eigenvectors().rowwise().reverse().leftCols(kept);
  for (Index k = 0; k < kept; ++k)  // the tip moves towards positive force, as the seed prints it
    if (modes.shape(modes.shape.rows() - 1, k) < 0) modes.shape.col(k) *= -1;
  return modes;
}

Basis make_basis(const Rig& rig, Index normal_modes, Index torsion_modes) {
  if (rig.is_modal()) return {};
  const Modes normal = chain_modes(rig.normal);
  const Modes torsion = chain_modes(rig.torsion);
  if (normal_modes > normal.omega.size() || torsion_modes > torsion.omega.size())
    throw std::invalid_argument(fmt::format("the rig has {} normal and {} torsional modes, {} and {} were asked for", normal.omega.size(),
                                            torsion.omega.size(), normal_modes, torsion_modes));
  const Index elements = rig.normal.inertia.size();
  Basis basis;
  basis.normal_modes = normal_modes;
  basis.torsion_modes = torsion_modes;
  basis.omega.resize(basis.size());
  basis.omega << normal.omega.head(normal_modes), torsion.omega.head(torsion_modes);
  basis.normal.setZero(elements, basis.size());
  basis.normal.leftCols(normal_modes) = normal.shape.leftCols(normal_modes);
  basis.twist.setZero(elements, basis.size());
  for (Index i = 0; i < elements; ++i) basis.twist.row(i).tail(torsion_modes) = torsion.shape.row(carrier(rig, i)).head(torsion_modes);
  basis.torsion_chain.setZero(rig.torsion.inertia.size(), basis.size());
  basis.torsion_chain.rightCols(torsion_modes) = torsion.shape.leftCols(torsion_modes);
  return basis;
}

Basis make_basis(const Rig& rig, double nyquist, double density) {
  if (rig.is_modal()) return {};
  const Modes normal = chain_modes(rig.normal);
  const Index torsion_modes = wanted_torsion_modes(rig, chain_modes(rig.torsion), nyquist);
  const Index available = normal.omega.size();
  if (rig.normal.modes > 0) return make_basis(rig, std::min<Index>(rig.normal.modes, available), torsion_modes);

  Index count = std::min(available, std::max<Index>(1, modes_below(normal.omega, nyquist)));
  Basis basis = make_basis(rig, count, torsion_modes);
  while (count < available) {
    const Basis richer = make_basis(rig, count + 1, torsion_modes);
    if (agree_below(coupled_frequencies(rig, basis, density), coupled_frequencies(rig, richer, density), nyquist)) break;
    basis = richer;
    ++count;
  }
  return basis;
}

}  // namespace unrig
