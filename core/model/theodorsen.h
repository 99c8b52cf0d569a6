#pragma once
#include <complex>

#include "core/model/wagner.h"

namespace unrig {

/// The frequency response C(k) that belongs to an indicial response phi, as Theodorsen's function belongs to Wagner's
/// (I. E. Garrick, NACA Report 629, 1938):
///
///     C(k) = i k Int_0^inf phi(s) exp(-i k s) ds = 1 - sum_j A_j i k / (i k + b_j),   k = omega b / U
///
/// k: reduced frequency [radians per semichord], any real number; C(-k) is the conjugate of C(k), C(0) = 1, C(infinity) = phi(0).
/// An error e(s) in phi that dies out becomes the error e(0) + Int_0^inf e'(s) exp(-i k s) ds in C, at most |e(0)| plus the total variation
/// of e. For the equal ripple of n poles, of size E, that is (4 n + 2) E; what is reached, about a tenth of it, stands beside each choice
/// in core/model/wagner.h.
std::complex<double> theodorsen(const IndicialFunction& phi, double k);

/// Theodorsen's function (T. Theodorsen, NACA Report 496, 1935), H the Hankel functions of the second kind, H = J - i Y, of argument k:
///
///     C(k) = H1 / (H1 + i H0)
///
/// k as above. Absolute error below 1e-12. Beyond k = 1000, where the library's Bessel functions lose digits, C is taken from its expansion
/// 1/2 + z/8 - z^2/16 + 7 z^3/128 in z = 1/(i k), whose next term is below 1e-12 there.
std::complex<double> theodorsen_exact(double k);

}  // namespace unrig
