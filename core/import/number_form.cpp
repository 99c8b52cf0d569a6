#include "core/import/number_form.h"

#include <algorithm>

#include <fmt/format.h>

#include "core/files/scan.h"

namespace unrig {
namespace {

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

/// "23.11.2026", "11/23/26", "12:00": numbers with . / - or : between them.
bool is_date_or_clock(std::string_view cell) {
  int numbers = 0;
  for (std::size_t i = 0; i < cell.size() && numbers < 3; ++i) {
    if (!is_digit(cell[i])) return false;
    while (i < cell.size() && is_digit(cell[i])) ++i;
    ++numbers;
    if (i < cell.size() && cell[i] == ':') return true;
    if (i < cell.size() && numbers < 3 && std::string_view("./-").find(cell[i]) == std::string_view::npos) return false;
  }
  return numbers == 3;
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
  if (digits && !is_date_or_clock(cell) && cell.find(other) != std::string_view::npos)
    return {fmt::format("{} has a {}, while the decimal sign is a {}", quoted(cell), other == '.' ? "point" : "comma", other == '.' ? "comma" : "point"),
            fmt::format("The mapping's [format] can say which it is: thousands = \"{0}\" where it sets off thousands, decimal = \"{0}\" where it is the decimal sign.", other)};
  if (digits && cell.find_first_of(" '") != std::string_view::npos)
    return {fmt::format("{} is no number", quoted(cell)), "Where something sets off thousands, the mapping's [format] can name it: thousands = \" \" or \"'\"."};
  if (is_date_or_clock(cell))
    return {fmt::format("{} is no number and no time stamp that can be read", quoted(cell)),
            "Time stamps are read as 2026-11-23T12:00:00.000 or 12:00:00.000; without them [time] can give the sampling rate, rate = \"500 Hz\", in place of a source."};
  return {fmt::format("{} is no number", quoted(cell)),
          fmt::format("Where it marks a missing sample, the mapping's [format] can say missing = [{}]; it can also name delimiter, decimal and skip_lines.", quoted(cell))};
}

void DecimalSign::see(std::string_view cell) {
  if (cell.empty() || cell.find_first_not_of("+-0123456789.,eE") != std::string_view::npos) return;
  if (cell.find_first_of(".,") == std::string_view::npos) return;
  const bool as_comma = cell_number(cell, {',', '.', {}}).has_value(), as_point = cell_number(cell, {'.', ',', {}}).has_value();
  comma_ = comma_ || (as_comma && !as_point);
  point_ = point_ || (as_point && !as_comma);
}

}  // namespace unrig
