#include "core/files/near_word.h"

#include <algorithm>
#include <numeric>
#include <utility>

namespace unrig {

std::string in_small_letters(std::string_view text) {
  std::string out(text);
  for (char& c : out)
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  return out;
}

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

std::string nearest_word(std::string_view word, const std::vector<std::string>& words) {
  constexpr std::size_t longest = 40;  // of a word that somebody misspelt
  if (word.size() > longest) return "";
  const std::string asked = in_small_letters(word);
  std::string nearest;
  std::size_t least = std::min<std::size_t>(2, asked.size() / 3) + 1;
  for (const std::string& one : words)
    if (const std::size_t edits = edits_between(asked, in_small_letters(one)); edits < least) nearest = one, least = edits;
  return nearest;
}

}  // namespace unrig
