#include "core/rig/cross_section.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include "core/rig/beam_flexibility.h"

namespace unrig {
namespace {

void require_positive(double value, const char* what) {
  if (!(value > 0)) throw std::invalid_argument(fmt::format("the {} of a section is {} m, not above zero", what, value));
}

void require_hollow(double outer, double wall) {
  require_positive(wall, "wall");
  if (!(2 * wall < outer)) throw std::invalid_argument(fmt::format("a wall of {} m leaves nothing hollow of {} m", wall, outer));
}

CrossSection minus(const CrossSection& outer, const CrossSection& inner) {
  return {outer.area - inner.area, outer.second_moment - inner.second_moment, outer.torsion_constant - inner.torsion_constant, outer.polar_second_moment - inner.polar_second_moment};
}

}  // namespace

CrossSection circular_section(double diameter) {
  require_positive(diameter, "diameter");
  const double second_moment = std::numbers::pi * std::pow(diameter, 4) / 64;
  return {std::numbers::pi * diameter * diameter / 4, second_moment, 2 * second_moment, 2 * second_moment};
}

CrossSection tube_section(double outer_diameter, double wall) {
  require_positive(outer_diameter, "outer diameter");
  require_hollow(outer_diameter, wall);
  return minus(circular_section(outer_diameter), circular_section(outer_diameter - 2 * wall));
}

CrossSection rectangular_section(double height, double width) {
  require_positive(height, "height");
  require_positive(width, "width");
  const double area = height * width;
  return {area, area * height * height / 12, rectangular_torsion_constant(height, width), area * (height * height + width * width) / 12};
}

CrossSection box_section(double height, double width, double wall) {
  require_positive(height, "height");
  require_positive(width, "width");
  require_hollow(std::min(height, width), wall);
  CrossSection box = minus(rectangular_section(height, width), rectangular_section(height - 2 * wall, width - 2 * wall));
  const double enclosed = (height - wall) * (width - wall), perimeter = 2 * (height - wall) + 2 * (width - wall);
  box.torsion_constant = 4 * enclosed * enclosed * wall / perimeter + perimeter * std::pow(wall, 3) / 3;
  return box;
}

}  // namespace unrig
