#pragma once
#include <Eigen/Core>
#include <string>

namespace unrig {

/// An indicial response that ends at 1, as a sum of decaying exponentials (form of the seed's Eq. 2.5):
///
///     phi(s) = 1 - sum_j A_j exp(-b_j s),   s = U t / b   (time in semichords travelled since the step)
///
/// `amplitude` holds the A_j [-], `rate` the b_j > 0 [per semichord]. Each term is one state of the coupled model. phi(0) = 1 - sum A_j.
struct IndicialFunction {
  std::string name;
  Eigen::VectorXd amplitude;
  Eigen::VectorXd rate;
  /// phi(s): 0 before the step (s < 0), 1 for s = infinity.
  double operator()(double s) const;
};

/// Wagner's function, phi(s): the share of its final value that the circulatory force of a thin airfoil in incompressible flow has reached
/// s semichords after a step in downwash at the three-quarter chord (seed, Eq. 2.3 and 2.4, there Gamma(tau); H. Wagner, ZAMM 5 (1925)
/// 17-35):
///
///     phi(s) = 1 - Int_0^inf exp(-x s) dx / { x^2 [ (K0 - K1)^2 + pi^2 (I0 + I1)^2 ] },   modified Bessel functions of argument x
///
/// Absolute error below 1e-12 for all s >= 0 (2e-15 measured); 0 for s < 0. Limits: phi = 1/2 + s/8 - s^2/32 + ... at the step, and
/// phi = 1 - 1/s - 2 (ln 2s - 1)/s^2 - ... long after it. Costs about a microsecond.
double wagner_exact(double s);

/// The integral of wagner_exact by the trapezoidal rule in ln x, which is itself a sum of exponentials: 207 terms, all amplitudes and
/// rates positive, rates from 1.4e-15 to 18 per semichord. The exact diagonal state model, for checks; too large to carry in a fit.
const IndicialFunction& wagner_quadrature();

/// Which approximation of Wagner's function the model carries. Beside each: poles, largest |error| over all s >= 0 (where), and in brackets
/// the largest |error| of the Theodorsen function that it implies, all measured in tests/core/model/wagner_test.cpp.
enum class Wagner {
  within_1e4,  ///< 6 poles, 9.66e-5 (equal ripple, the first at s = 0) [2.86e-4]
  within_1e6,  ///< 13 poles, 7.29e-7 (equal ripple, the first at s = 0) [2.68e-6]
  jones,       ///< 2 poles, 9.59e-3 (s = 82; at s = 100, 1 - phi is 84 % too small) [1.46e-2]: R. T. Jones, NACA Report 681 (1940)
  seed,        ///< 2 poles, 2.26e-2 (s = 0.5) [3.18e-2]: the coefficients behind the seed's Eq. 3.23, which is misprinted
};

/// The approximation, rates ascending. `within_1e4` and `within_1e6` are the best sums of that many exponentials in the sense of the
/// largest error, and the fewest exponentials that stay within 1e-4 and 1e-6 (the best of 5 reaches 2.4e-4, of 12 1.3e-6;
/// tests/support/fit_wagner.py). Their value at the step is above 1/2 by the largest error. `jones` is 0.165/0.0455, 0.335/0.3; `seed` is
/// 0.165/0.0455, 0.355/0.3.
IndicialFunction wagner(Wagner which);

/// By name ("1e-4", "1e-6", "jones", "seed"), which is also the `name` of the result of wagner(). Throws std::invalid_argument naming the
/// choices.
Wagner wagner_from_name(const std::string& name);

}  // namespace unrig
