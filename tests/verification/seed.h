#pragma once
#include <Eigen/Core>
#include <string>
#include <vector>

#include "core/model/aeroelastic_model.h"
#include "core/model/ideal_step.h"
#include "core/run/motion.h"

/// What the verification tests share about "Effect of Aeroelasticity in Tow Tank Strain Gauge Measurements on a NACA 0015 Airfoil" (Ohio
/// University), here the seed: its printed numbers, its equations as it wrote them, and its rig in unrig. Inch, pound mass, second.
namespace unrig::seed {

// ------------------------------------------------------------------------------------------------ printed numbers

inline constexpr double semichord = 3;                       // in
inline constexpr double span = 42;                           // in
inline constexpr double speed = 24;                          // in/s
inline constexpr double density = 0.03613;                   // lbm/in^3
inline constexpr double semichord_time = semichord / speed;  // s
inline constexpr double degree = 0.017453292519943295;
inline constexpr double ideal_amplitude = 1 * degree;  // section 3.10

/// Eq. 3.4a, 3.4b
extern const Eigen::VectorXd printed_normal_shape, printed_torsion_shape;

/// The equations of motion in the seed's form (Eq. 3.21, 3.22), nondimensional, as it moved them to one side:
///
///   m q'' - mg g'' - cg g' + k q + lq Int G q'' - lg Int G (g'' + g') = mg p'' + cg p' + lg Int G (p'' + p')
///   tq q'' - tgg g'' - tg g' - kt g = p2 p'' + p1 p'
///
/// with G(t) = 1 - A1 exp(-b1 t) - A2 exp(-b2 t).
struct Equations {
  double m, mg, cg, k, lq, lg;
  double tq, tgg, tg, kt, p2, p1;
  double n2, n1, nl;  ///< of p'', p' and the convolution in the normal equation
  double A[2] = {0.165, 0.355}, b[2] = {0.0455, 0.3};
};

/// As printed in Eq. 3.22 (with the scan's 2.006 read as 2.066, 9.662 g as 9.662 q); the step of 1 deg divided out again.
Equations printed_equations();

/// The same coefficients from a rig by the definitions under Eq. 3.17: one normal and one torsional mode, normalised to 1 at elements 17
/// and 13. p2 as the seed has it: the inertia of the part carried by `rigid_from` alone (Eq. 3.15), not of the whole shaft that turns.
Equations equations_of(const Rig& rig);

// ------------------------------------------------------------------------------------------------ its solution

/// Polynomials in s, lowest power first.
struct Transform {
  Eigen::VectorXd denominator;  ///< degree 7, without constant term
  Eigen::VectorXd q, g;         ///< numerators
};

/// Appendix B as printed.
Transform printed_appendix_b();

/// Q(s) and G(s) for a step of `amplitude` [rad], by Cramer's rule on Eq. 3.23.
Transform solve(const Equations& equations, double amplitude);

/// Appendix B's own numbers in, as they stand in its `Solve`: rounded, each product of Wagner's amplitudes for itself.
Transform solve_appendix_b_input();

Eigen::VectorXcd roots(const Eigen::VectorXd& polynomial);

/// The constants of Table 1 in the form
/// A + B exp(-.29 t) + C exp(-.0454 t) + exp(-.42 t)(D sin 2.29 t + E cos 2.29 t) + exp(-.825 t)(F sin 49.75 t + G cos 49.75 t)
struct Constants {
  double A, B, C, D, E, F, G;
};
inline constexpr Constants printed_q{9.73e-3, -2.59e-3, -1.57e-3, 1.77e-2, 9.25e-3, -1.04e-3, -1.55e-2};
inline constexpr Constants printed_g{0, -1.33e-7, -1.63e-9, -5.10e-5, -5.50e-5, -3.79e-4, -2.40e-2};

/// From partial fractions: residues at the poles of a transform, or of an ideal step; poles in nondimensional time.
Constants constants_of(const Eigen::VectorXd& numerator, const Eigen::VectorXd& denominator);
Constants constants_of(const Eigen::VectorXcd& pole, const Eigen::RowVectorXcd& residue, double steady);

/// Appendix C to the letter: the roots rounded as there, the denominator divided by its leading coefficient (they multiply to a monic
/// polynomial), the numerator not.
Constants appendix_c(const Eigen::VectorXd& numerator);

/// The printed equations as a system of unrig, in nondimensional time: states q, g, q', g', two lags, p, p', p''; outputs q and g.
LinearSystem system_of(const Equations& equations);

// ------------------------------------------------------------------------------------------------ its rig in unrig

std::string sample(const std::string& file);  ///< path in sample_data/seed
Rig rig();                                    ///< printed matrices
Rig rig_from_drawings();                      ///< virtual work

/// sample_data/seed/step.csv: 1.3 deg from 2.09 deg, onset at sample 200.
struct SampledMotion {
  Eigen::VectorXd angle;  ///< rad
  double dt;              ///< s
  Motion motion;
};
SampledMotion step_motion();

/// Speed and water of the seed with prescribed pitch.
Conditions towed();
Conditions still_water();

/// Without structural damping, as the seed.
AeroelasticModel model(const Rig& rig, Eigen::Index normal_modes, Eigen::Index torsion_modes, const IndicialFunction& circulation);
Eigen::VectorXd undamped(const AeroelasticModel& model);

/// What the gauge would read if it were judged by the curvature of the modes kept (seed, section 4.1): the modes' own bending moment at the
/// gauge, omega_k^2 sum over outboard elements of m phi_k (x - x_gauge), over the lever to the calibration station; a row over the
/// coordinates.
Eigen::RowVectorXd curvature_reading(const AeroelasticModel& model);

/// The five-point second derivative of section 4.1 at the load cell's middle, of a quantity given at all elements, per inch squared.
double five_point_curvature(const Eigen::VectorXd& shape);

/// Normal-force coefficient N / (rho U^2 b l) of a force in newtons.
double coefficient(double newtons);

}  // namespace unrig::seed
