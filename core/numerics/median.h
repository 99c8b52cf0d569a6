#pragma once
#include <algorithm>
#include <iterator>
#include <vector>

namespace unrig {

/// A normal distribution's standard deviation over its median absolute deviation, 1 / Phi^-1(3/4).
inline constexpr double median_to_sigma = 1.482602218505602;

/// The middle one in order, the upper of two; 0 where there are no values. Linear time.
inline double median(std::vector<double> values) {
  if (values.empty()) return 0;
  const auto middle = values.begin() + std::ssize(values) / 2;
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace unrig
