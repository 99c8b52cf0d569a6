#include "fit/effect_option.h"

#include <fmt/format.h>

#include <algorithm>
#include <stdexcept>

#include "core/effects/effect.h"
#include "core/error.h"

namespace unrig {

std::vector<std::string> effects_of_option(const std::string& option, const std::vector<std::string>& ids) try {
  std::vector<std::string> known;
  for (const std::string& id : ids)
    if (const std::string name = effect(id).id; std::find(known.begin(), known.end(), name) == known.end()) known.push_back(name);
  return known;
} catch (const std::invalid_argument& e) {
  throw InputError({option, 0}, e.what(), "wanted one of these", "");
}

std::string effect_list() {
  std::string list = "Effects:\n";
  for (const Effect& e : effects()) list += fmt::format("  {:<20}{}\n", e.id, e.summary);
  return list;
}

}  // namespace unrig
