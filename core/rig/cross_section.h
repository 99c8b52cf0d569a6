#pragma once

namespace unrig {

/// What bending, torsion and inertia need of a cross-section. The bending deflection is along its height, about its centroid.
struct CrossSection {
  double area = 0;            ///< m^2
  double second_moment = 0;   ///< I [m^4] of bending, about the axis along the width
  double torsion_constant = 0;   ///< J [m^4] of Saint-Venant's free torsion
  double polar_second_moment = 0;  ///< I_p [m^4] about the centroid: rho I_p is the moment of inertia per length
};

/// A solid circle of diameter d > 0 [m]: A = pi d^2 / 4, I = pi d^4 / 64, J = I_p = 2 I (Timoshenko and Goodier, Theory of Elasticity, 3rd ed., section 101:
/// a circle does not warp). Throws std::invalid_argument, as all below, for dimensions that are not positive.
CrossSection circular_section(double diameter);

/// A round tube of outer diameter D and wall t, 0 < t < D / 2 [m], d = D - 2 t:
///
///     A = pi (D^2 - d^2) / 4,  I = pi (D^4 - d^4) / 64,  J = I_p = 2 I,
///
/// exact for any wall: a circular ring does not warp either (EN 10210-2:2006, sectional properties of circular hollow sections).
CrossSection tube_section(double outer_diameter, double wall);

/// A solid rectangle of height h, along the deflection, and width b [m]: A = b h, I = b h^3 / 12, I_p = b h (b^2 + h^2) / 12, and J by Saint-Venant's series
/// (core/rig/beam_flexibility.h).
CrossSection rectangular_section(double height, double width);

/// A rectangular tube of height h, width b and a wall t on all sides, 0 < t < min(h, b) / 2 [m], sharp corners, h_i = h - 2 t, b_i = b - 2 t:
///
///     A = b h - b_i h_i,  I = (b h^3 - b_i h_i^3) / 12,  I_p = I + (h b^3 - h_i b_i^3) / 12,
///     J = 4 A_m^2 t / s + s t^3 / 3,  A_m = (b - t)(h - t),  s = 2 (b - t) + 2 (h - t),
///
/// Bredt's closed tube and the wall's own torsion (EN 10210-2:2006, torsional inertia constant of rectangular hollow sections, corner radius 0). J lies within 7 % of
/// the exact solution for any wall (tests/core/rig/cross_section_test.cpp).
CrossSection box_section(double height, double width, double wall);

}  // namespace unrig
