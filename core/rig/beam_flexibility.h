#pragma once
#include <Eigen/Core>

namespace unrig {

/// A clamped beam or shaft of elements laid end to end, each with constant stiffness, and loads at stations along it.
///
/// The rig file's form of it is described in core/rig/rig.h. All in SI.
struct SteppedBeam {
  Eigen::VectorXd length;        ///< m, per element, from the clamp
  Eigen::VectorXd stiffness;     ///< E I [N m^2] in bending, G J [N m^2] in torsion, per element
  Eigen::VectorXd station;       ///< m from the clamp, one in each element
  double clamp_rotation = 0;     ///< rad/(N m): how far the clamp turns under a moment (in torsion: under a torque)
  double clamp_translation = 0;  ///< m/N: how far the clamp gives under a force; bending only
};

/// Bending flexibility by virtual work (seed, Eq. A.1):
///
///     A_ij = Int_0^min(x_i, x_j) (x_i - x) (x_j - x) dx / (E I) + x_i x_j c_r + c_t,
///
/// the deflection [m/N] at station i under a unit force at j; c_r and c_t are the clamp's rotation and translation per unit load.
/// Slender-beam (Bernoulli) theory: the shear deflection is left out, which at distance l from the clamp is 0.3 E h^2 / (G l^2) of the
/// bending for a rectangle of depth h. The integral is taken element by element in closed form, with terms of one sign only, so that it is
/// exact to round-off. Throws std::invalid_argument, naming the element, for lengths or stiffness that are not positive, a negative
/// compliance, sizes that differ, and a station outside its element.
Eigen::MatrixXd bending_flexibility(const SteppedBeam& beam);

/// Torsional flexibility of shafts (seed, Eqs. A.2, A.3): A_ij = Int_0^min(x_i, x_j) dx / (G J) + c_r, the twist [rad/(N m)] at station i
/// under a unit torque at j. Saint-Venant's free torsion: warping restrained by the clamp is left out. Throws as above.
Eigen::MatrixXd torsion_flexibility(const SteppedBeam& shaft);

/// J = pi d^4 / 32 [m^4], the polar second moment of a circular section of diameter d > 0 [m] (for the seed's Eq. A.2).
double circular_torsion_constant(double diameter);

/// J = beta a^3 b [m^4] of a rectangular section with sides a and b > 0 [m], in any order (for the seed's Eq. A.3).
double rectangular_torsion_constant(double a, double b);

/// The factor beta of a rectangle with long side over short side `ratio` >= 1, by Saint-Venant's series (Timoshenko and Goodier, Theory of
/// Elasticity, 3rd ed., section 109),
///
///     beta = 1/3 { 1 - 192 / (pi^5 ratio) Sum_{n = 1, 3, 5...} tanh(n pi ratio / 2) / n^5 },
///
/// to round-off: 0.1406 for the square, 1/3 for the thin strip.
double rectangular_torsion_factor(double ratio);

}  // namespace unrig
