#include "fit/likelihood/coarse_converter.h"

#include <algorithm>
#include <cmath>

#include "core/run/motion.h"

namespace unrig {

using Eigen::Index;
using Eigen::VectorXd;

double CoarseConverter::usual_error() const {
  constexpr double coarse = 3.5;  // standard deviations to a step
  return step * std::sqrt(1 / (coarse * coarse) + 1.0 / 12);
}

double CoarseConverter::error(const VectorXd& residual) const {
  if (step == 0) return 0;
  double sum = 0;
  Index count = 0;
  for (const double r : residual)
    if (std::isfinite(r)) sum += std::pow(std::min(std::abs(r), step / 2), 2), ++count;
  return count > 0 ? std::sqrt(sum / static_cast<double>(count)) : 0;
}

VectorXd CoarseConverter::beyond(const VectorXd& residual) const {
  constexpr double of_noise = 0.1472;  // steps: root mean square of max(0, |r| - 1/2), r normal of variance 1/9 + 1/12
  return residual.unaryExpr([this](double r) { return std::copysign(std::max(0.0, std::abs(r) - step / 2), r) / (of_noise * step); });
}

CoarseConverter coarse_converter(const VectorXd& readings, double white) {
  const CoarseConverter converter{std::sqrt(12.0) * rounding_level(readings)};
  return white < converter.usual_error() ? converter : CoarseConverter();
}

}  // namespace unrig
