#include "fit/uncertainty/out_of_proportion.h"

#include <cmath>

#include <fmt/format.h>

namespace unrig {
namespace {

const FittedParameter* mass_of(const FittedParameter& p, const std::vector<FittedParameter>& parameters) {
  for (const FittedParameter& other : parameters)
    if (other.mode == p.mode && other.role == Role::mass) return &other;
  return nullptr;
}

}  // namespace

std::vector<std::string> out_of_proportion(const std::vector<FittedParameter>& parameters) {
  constexpr double largest = 10;
  std::vector<std::string> sentences;
  for (const FittedParameter& p : parameters) {
    if (p.mode < 0 || p.role != Role::load) continue;  // how far the mount drives its mode
    const FittedParameter* mass = mass_of(p, parameters);
    const double error = std::isfinite(p.std_error) ? p.std_error : 0;
    if (!mass || !(std::abs(p.value) - error > largest * mass->value)) continue;
    sentences.push_back(fmt::format("{} = {:.3g} kg is {:.2g} times the mass of its mode, out of any proportion: that ratio is about 1 for a mode that the mount drives. The mode stands in for something else, or the unit of the "
                                    "mount's column, of the gauge or of gauge_gain is wrong.",
                                    p.name, p.value, std::abs(p.value) / mass->value));
  }
  return sentences;
}

}  // namespace unrig
