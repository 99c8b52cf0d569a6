#pragma once
#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace unrig {

/// Letters put in, left out, exchanged, or swapped with the next (Damerau 1964, Levenshtein 1966), from one word to the other.
std::size_t edits_between(std::string_view a, std::string_view b);

/// The one of `words` that was probably meant by `word`: equal but for capitals, or at most one letter in three wrong (two at most). Empty where none is that near.
std::string nearest_word(std::string_view word, const std::vector<std::string>& words);

std::string in_small_letters(std::string_view text);

}  // namespace unrig
