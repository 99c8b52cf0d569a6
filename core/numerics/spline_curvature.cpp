#include "core/numerics/spline_curvature.h"

namespace unrig {

using Eigen::Index;
using Eigen::VectorXd;

VectorXd spline_curvature(const VectorXd& value, double dt) {
  const Index n = value.size();
  VectorXd curvature = VectorXd::Zero(n);
  if (n < 3) return curvature;
  const VectorXd second = (value.head(n - 2) - 2 * value.segment(1, n - 2) + value.tail(n - 2)) / (dt * dt);
  // Not-a-knot: the second knot's own equation is 6 u'' = 6 times the second difference, since its neighbours' are 2 u'' together; likewise at the end.
  curvature[1] = second[0];
  curvature[n - 2] = second[n - 3];
  if (n > 4) {  // Gaussian elimination between them, every pivot above 3
    VectorXd above(n);
    above[1] = 0;
    for (Index k = 2; k < n - 2; ++k) {
      const double pivot = 4 - above[k - 1];
      above[k] = 1 / pivot;
      curvature[k] = (6 * second[k - 1] - curvature[k - 1]) / pivot;
    }
    for (Index k = n - 3; k > 1; --k) curvature[k] -= above[k] * curvature[k + 1];
  }
  curvature[0] = n > 3 ? 2 * curvature[1] - curvature[2] : curvature[1];
  curvature[n - 1] = n > 3 ? 2 * curvature[n - 2] - curvature[n - 3] : curvature[1];
  return curvature;
}

}  // namespace unrig
