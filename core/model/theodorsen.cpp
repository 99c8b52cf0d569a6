#include "core/model/theodorsen.h"

#include <cmath>

namespace unrig {

std::complex<double> theodorsen(const IndicialFunction& phi, double k) {
  // i k / (i k + b) = 1 / (1 + r^2) + i / (r + 1/r), r = b / k: right at k = 0 and at infinity too.
  const Eigen::ArrayXd r = phi.rate.array() / k;
  return {1 - (phi.amplitude.array() / (1 + r.square())).sum(), -(phi.amplitude.array() / (r + r.inverse())).sum()};
}

std::complex<double> theodorsen_exact(double k) {
  using complex = std::complex<double>;
  if (k < 0) return std::conj(theodorsen_exact(-k));
  if (k < 1e-300) return 1;  // H1 overflows soon; 1 - C is of order k
  if (k > 1000) {
    const complex z(0, -1 / k);
    return 0.5 + z * (1.0 / 8 + z * (-1.0 / 16 + z * (7.0 / 128)));
  }
  const complex h0(std::cyl_bessel_j(0, k), -std::cyl_neumann(0, k));
  const complex h1(std::cyl_bessel_j(1, k), -std::cyl_neumann(1, k));
  return h1 / (h1 + complex(0, 1) * h0);
}

}  // namespace unrig
