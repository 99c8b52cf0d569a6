#pragma once
#include <fast_float/fast_float.h>

#include <string_view>

namespace unrig {

/// Reads the decimal number at the head of [first, last), with a point whatever the locale, and returns where it ends; `first` where
/// there is none. A plus sign is accepted. "nan" and "inf" are numbers here: the caller judges them, and what follows the number.
inline const char* read_number(const char* first, const char* last, double& value) {
  // fast_float leaves the plus sign to its caller; "+-1" stays an error.
  const bool plus = last - first > 1 && *first == '+' && first[1] != '-';
  const char* digits = plus ? first + 1 : first;
  const auto read = fast_float::from_chars(digits, last, value);
  return read.ec == std::errc() ? read.ptr : first;
}

/// `text` without the blanks around it.
inline std::string_view trimmed(std::string_view text) {
  const auto first = text.find_first_not_of(" \t");
  return first == std::string_view::npos ? std::string_view{} : text.substr(first, text.find_last_not_of(" \t") - first + 1);
}

inline bool is_digit(char c) { return c >= '0' && c <= '9'; }

/// Of a name: ASCII, and the underscore.
inline bool is_letter(char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_'; }

}  // namespace unrig
