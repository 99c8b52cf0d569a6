#pragma once
#include <Eigen/Core>

#include "core/rig/rig.h"

namespace unrig {

/// Free vibration of a chain in vacuum (seed, Eq. 3.3-3.4), lowest first, shapes normalised to unit generalised mass.
struct Modes {
  Eigen::VectorXd omega;  ///< rad/s
  Eigen::MatrixXd shape;  ///< elements x modes; shape^T M shape = I
};

/// The modes of a chain: eigenvectors of D = A M (seed, Eq. 3.3a-b), from the symmetric M^1/2 A M^1/2.
///
/// A printed flexibility matrix is positive definite only up to rounding; eigenvalues below 1e-9 of the largest are rounding noise and their
/// modes (beyond 30000 times the first frequency squared) are left out.
Modes chain_modes(const Chain& chain);

/// The rig's generalised coordinates: normal modes, then torsional modes, and what each does at every normal element.
///
/// `heave` and `pitch` extend the modal rows by the two prescribed coordinates of the whole rig: heave of the mount and rotation of the shaft.
/// Displacement of element i in the direction of the normal force: normal.row(i) * x; its twist (nose up): twist.row(i) * x.
struct Basis {
  Eigen::Index normal_modes = 0;
  Eigen::Index torsion_modes = 0;
  Eigen::VectorXd omega;   ///< rad/s in vacuum at the rig file's stiffness, normal then torsional
  Eigen::MatrixXd normal;  ///< elements x coordinates
  Eigen::MatrixXd twist;   ///< elements x coordinates, extended over the rigid part (seed, Eq. 3.4c)
  Eigen::MatrixXd torsion_chain;  ///< elements of the torsional chain x coordinates: their twist

  Eigen::Index size() const { return normal_modes + torsion_modes; }
};

/// Basis with the given numbers of modes; an empty one of a rig that is known as modes. Throws std::invalid_argument where the rig has fewer.
Basis make_basis(const Rig& rig, Eigen::Index normal_modes, Eigen::Index torsion_modes);

/// The basis the rig file asks for. "all" means: every mode in vacuum below `nyquist` [Hz], and then as many more as it takes until a further
/// one moves no frequency below `nyquist`, with the apparent mass of a fluid of `density` [kg/m^3], by more than 1e-3 of itself: in a thin
/// basis of vacuum modes the frequencies in water converge slowly (tests/verification/printed_numbers_test.cpp).
Basis make_basis(const Rig& rig, double nyquist, double density);

/// The lowest resonance [Hz] as the rig file has it: of a beam with its first modes, in a fluid of `density` [kg/m^3].
double lowest_frequency(const Rig& rig, double density);

/// Frequencies [Hz] of the coupled rig at rest in a fluid (no damping, speed 0), ascending.
Eigen::VectorXd coupled_frequencies(const Rig& rig, const Basis& basis, double density, double apparent_mass_coefficient = 1);

}  // namespace unrig
