#pragma once

namespace unrig {

/// From 0 to 1 in 0 <= x <= 1, constant outside, with three derivatives that vanish at either end: x^4 (35 - 84 x + 70 x^2 - 20 x^3).
inline double smooth_ramp(double x) {
  if (x <= 0) return 0;
  if (x >= 1) return 1;
  return x * x * x * x * (35 + x * (-84 + x * (70 - 20 * x)));
}

}  // namespace unrig
