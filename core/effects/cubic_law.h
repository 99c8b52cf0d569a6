#pragma once

namespace unrig {

/// A spring that stiffens about a point off its rest: f = -k_3 ((z + d)^3 - d^3), p = (k_3, d); a law for append_feedback.
inline double cubic_law(double z, const double* p, double& slope, double* partial) {
  const double k = p[0], d = p[1], shape = z * (z * z + 3 * z * d + 3 * d * d);
  slope = -k * 3 * (z + d) * (z + d);
  partial[0] = -shape;
  partial[1] = -k * 3 * z * (z + 2 * d);
  return -k * shape;
}

}  // namespace unrig
