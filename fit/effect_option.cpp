#include "fit/effect_option.h"

#include <fmt/format.h>

#include <algorithm>
#include <stdexcept>

#include "core/effects/effect.h"
#include "core/files/error.h"
#include "core/law/law_effect.h"

namespace unrig {
namespace {

std::vector<Conditions> conditions_of_all(const std::vector<Run>& runs) {
  std::vector<Conditions> all;
  for (const Run& run : runs) all.push_back(conditions_of(run));
  return all;
}

}  // namespace

std::vector<std::string> effects_of_option(const std::string& option, const std::vector<std::string>& ids) try {
  std::vector<std::string> known;
  for (const std::string& id : ids)
    if (const std::string name = effect(id).id; std::find(known.begin(), known.end(), name) == known.end()) known.push_back(name);
  return known;
} catch (const std::invalid_argument& e) {
  throw InputError({option, 0}, e.what(), "wanted one of these", "");
}

void refuse_idle(const std::string& option, const std::vector<std::string>& ids, const Rig& rig, const std::vector<Run>& runs) {
  const std::vector<Conditions> conditions = conditions_of_all(runs);
  for (const std::string& id : ids)
    if (const std::string why = why_idle(effect(rig, id), rig, conditions); !why.empty())
      throw InputError({option, 0}, id + " can act in none of these runs", "wanted what it needs: " + why, "Leave it out, or give such a run.");
}

std::vector<std::string> effects_that_act(const Rig& rig, const std::vector<Run>& runs) {
  std::vector<std::string> ids;
  for (const Effect& e : effects())
    if (why_idle(e, rig, conditions_of_all(runs)).empty()) ids.push_back(e.id);
  return ids;
}

std::vector<std::string> add_laws(Rig& rig, const std::vector<std::string>& paths) {
  std::vector<std::string> ids;
  for (const std::string& path : paths) {
    add_law(rig, read_law(path));
    ids.push_back(rig.laws.back()->id);
  }
  return ids;
}

std::string effect_list() {
  std::string list = "Effects:\n";
  for (const Effect& e : effects()) list += fmt::format("  {:<20}{}\n", e.id, e.summary);
  return list;
}

}  // namespace unrig
