#include "core/run/column_names.h"

#include <algorithm>
#include <array>
#include <utility>

#include "core/files/near_word.h"
#include "core/run/run.h"

namespace unrig {

std::string meant_column(std::string_view name, const std::vector<std::string>& present) {
  constexpr std::array words = {std::pair{"angle", "alpha"}, std::pair{"angle of attack", "alpha"}, std::pair{"aoa", "alpha"}, std::pair{"incidence", "alpha"},
                                std::pair{"bridge", "gauge"}, std::pair{"strain", "gauge"}, std::pair{"load", "gauge"}, std::pair{"strain gauge", "gauge"}};
  const auto is_present = [&](std::string_view column) { return std::find(present.begin(), present.end(), column) != present.end(); };
  const std::string asked = in_small_letters(name);
  if (asked.size() > 40) return "";
  for (const auto& [word, column] : words)
    if (asked == word && !is_present(column)) return column;
  for (const std::string_view column : columns_with_a_meaning())
    if (!is_present(column) && edits_between(asked, column) <= (column.size() > 6 ? 2 : 1)) return std::string(column);
  return "";
}

}  // namespace unrig
