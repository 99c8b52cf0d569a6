#include "core/import/column_names.h"

#include <algorithm>
#include <array>
#include <numeric>
#include <utility>

#include "core/run.h"

namespace unrig {
namespace {

std::string in_small_letters(std::string_view text) {
  std::string out(text);
  for (char& c : out)
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  return out;
}

/// Letters put in, left out, exchanged, or swapped with the next (Damerau and Levenshtein's distance).
std::size_t edits_between(std::string_view a, std::string_view b) {
  std::vector<std::size_t> before_last, last(b.size() + 1), current(b.size() + 1);
  std::iota(last.begin(), last.end(), std::size_t(0));
  for (std::size_t i = 1; i <= a.size(); ++i) {
    current[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      current[j] = std::min({last[j] + 1, current[j - 1] + 1, last[j - 1] + (a[i - 1] == b[j - 1] ? 0 : 1)});
      const bool swapped = i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1];
      if (swapped) current[j] = std::min(current[j], before_last[j - 2] + 1);
    }
    before_last = std::exchange(last, current);
  }
  return last[b.size()];
}

}  // namespace

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
