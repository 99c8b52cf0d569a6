#pragma once
#include <Eigen/Core>
#include <cmath>

namespace unrig {

/// Largest reduced chi-square that noise alone leaves. Of so many degrees of freedom n it scatters by sqrt(2/n), five times of which happen once in two million; the noise level that it
/// counts in is itself an estimate, and its square is good to some per cent.
inline double most_of_noise(Eigen::Index degrees_of_freedom) {
  constexpr double of_the_level = 0.2, chance = 5;
  return 1 + of_the_level + chance * std::sqrt(2 / static_cast<double>(degrees_of_freedom));
}

/// Least one: below it the noise level is too high for what is left, as where a few wrong readings made it, or a converter is coarser than the noise.
inline double least_of_noise(Eigen::Index degrees_of_freedom) { return 1 / most_of_noise(degrees_of_freedom); }

}  // namespace unrig
