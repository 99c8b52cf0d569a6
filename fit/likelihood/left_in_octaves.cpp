#include "fit/likelihood/left_in_octaves.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/numerics/spectrum.h"

namespace unrig {

using Eigen::Index;
using Eigen::VectorXd;

double LeftInOctaves::at(double frequency) const {
  if (density.size() == 0) return 0;
  const double line = frequency / from;
  return density[line < 1 ? 0 : std::min(static_cast<Index>(std::log2(line)), density.size() - 1)];
}

LeftInOctaves left_in_octaves(const VectorXd& residual, const VectorXd& weight, double dt, double noise) {
  constexpr Index fewest = 8;
  const Index samples = residual.size(), counted = (weight.array() > 0).count();
  const VectorXd there = (weight.array() > 0).select(residual, 0);
  if (counted < fewest || !there.allFinite()) return {};
  const VectorXd power = 2 * dt / static_cast<double>(counted) * fourier(there).cwiseAbs2();
  std::vector<double> density;
  for (Index first = 1; first < power.size(); first *= 2) {
    const Index lines = std::min(2 * first, power.size()) - first;
    density.push_back(std::max(0.0, power.segment(first, lines).mean() - 2 * dt * noise * noise));
  }
  return {1 / (static_cast<double>(samples) * dt), Eigen::Map<const VectorXd>(density.data(), static_cast<Index>(density.size()))};
}

}  // namespace unrig
