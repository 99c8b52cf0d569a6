#include "fit/uncertainty/out_of_proportion.h"

#include <cmath>

#include <fmt/format.h>

namespace unrig {
namespace {

constexpr std::string_view participation = ".mount_participation";

const FittedParameter* mass_of(const FittedParameter& p, const std::vector<FittedParameter>& parameters) {
  const std::string name = p.name.substr(0, p.name.size() - participation.size()) + ".mass";
  for (const FittedParameter& other : parameters)
    if (other.name == name) return &other;
  return nullptr;
}

}  // namespace

std::vector<std::string> out_of_proportion(const std::vector<FittedParameter>& parameters) {
  constexpr double largest = 10;
  std::vector<std::string> sentences;
  for (const FittedParameter& p : parameters) {
    if (!p.name.ends_with(participation)) continue;
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
