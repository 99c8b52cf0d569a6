#include "core/import/number_form.h"

#include <algorithm>

#include <fmt/format.h>

#include "core/scan.h"

namespace unrig {
namespace {

bool is_digit(char c) { return c >= '0' && c <= '9'; }

std::optional<double> number_with_point(std::string_view text) {
  double value = 0;
  if (text.empty() || read_number(text.data(), text.data() + text.size(), value) != text.data() + text.size()) return std::nullopt;
  return value;
}

/// "1.107.250" -> "1107250"; nothing where the groups are not of three digits.
std::optional<std::string> without_thousands(std::string_view whole, char thousands) {
  std::string out;
  if (!whole.empty() && (whole.front() == '+' || whole.front() == '-')) {
    out += whole.front();
    whole.remove_prefix(1);
  }
  for (bool first = true;; first = false) {
    const std::size_t end = std::min(whole.find(thousands), whole.size());
    const std::string_view group = whole.substr(0, end);
    const bool last = end == whole.size();
    if (!std::all_of(group.begin(), group.end(), is_digit) || group.size() > 3 || (first ? group.empty() : group.size() < 3)) return std::nullopt;
    if (first && !last && group.front() == '0') return std::nullopt;  // nobody sets off the thousands of nothing: "0.500" is a half
    out += group;
    if (last) return out;
    whole.remove_prefix(end + 1);
  }
}

std::string quoted(std::string_view cell) { return fmt::format("\"{}\"{}", cell.substr(0, 40), cell.size() > 40 ? "..." : ""); }

}  // namespace

std::optional<double> cell_number(std::string_view cell, const NumberForm& form) {
  if (form.decimal == '.' && form.thousands == '\0') return number_with_point(cell);
  const std::size_t end = std::min({cell.find(form.decimal), cell.find_first_of("eE"), cell.size()});
  std::string whole(cell.substr(0, end)), rest(cell.substr(end));
  if (form.thousands != '\0' && whole.find(form.thousands) != std::string::npos) {
    const std::optional<std::string> digits = without_thousands(whole, form.thousands);
    if (!digits) return std::nullopt;
    whole = *digits;
  }
  if (form.decimal == ',') {
    if (whole.find('.') != std::string::npos || rest.find('.') != std::string::npos) return std::nullopt;
    if (rest.starts_with(',')) rest.front() = '.';
  }
  return number_with_point(whole + rest);
}

NoNumber why_no_number(std::string_view cell, const NumberForm& form) {
  const char other = form.decimal == ',' ? '.' : ',';
  const bool digits = std::any_of(cell.begin(), cell.end(), is_digit) && cell.find_first_not_of("+-0123456789.,eE' ") == std::string_view::npos;
  if (digits && form.thousands != '\0' && cell.find(form.thousands) != std::string_view::npos)
    return {fmt::format("{} is no number whose thousands are set off by \"{}\" and whose decimal sign is \"{}\"", quoted(cell), form.thousands, form.decimal),
            "The mapping's [format] names both: decimal and thousands."};
  if (digits && cell.find(other) != std::string_view::npos)
    return {fmt::format("{} has a {}, while the decimal sign is a {}", quoted(cell), other == '.' ? "point" : "comma", other == '.' ? "comma" : "point"),
            fmt::format("The mapping's [format] can say which it is: thousands = \"{0}\" where it sets off thousands, decimal = \"{0}\" where it is the decimal sign.", other)};
  if (digits && cell.find_first_of(" '") != std::string_view::npos)
    return {fmt::format("{} is no number", quoted(cell)), "Where something sets off thousands, the mapping's [format] can name it: thousands = \" \" or \"'\"."};
  return {fmt::format("{} is no number", quoted(cell)), "The mapping's [format] can name delimiter, decimal and skip_lines."};
}

void DecimalSign::see(std::string_view cell) {
  if (cell.empty() || cell.find_first_not_of("+-0123456789.,eE") != std::string_view::npos) return;
  const std::size_t comma = cell.find(','), point = cell.find('.');
  if (comma == std::string_view::npos) {
    if (point != std::string_view::npos && number_with_point(cell)) point_ = true;
    return;
  }
  const NumberForm with_comma{',', '.', {}}, with_point{'.', ',', {}};
  const bool as_comma = cell_number(cell, with_comma).has_value(), as_point = cell_number(cell, with_point).has_value();
  if (as_comma && !as_point) comma_ = true;
  if (as_point && !as_comma) point_ = true;
}

}  // namespace unrig
