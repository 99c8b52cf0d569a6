#include "correct/how_far_to_trust.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <fmt/format.h>

namespace unrig {
namespace {

constexpr const char* chi2_column = "reduced_chi2";
constexpr std::string_view warning_column = "warning: ";

/// What no reader of a header takes for anything but text.
std::string as_name(std::string text) {
  for (const auto& [sign, instead] : {std::pair{',', ';'}, {'"', '\''}, {'[', '('}, {']', ')'}, {'\n', ' '}}) std::replace(text.begin(), text.end(), sign, instead);
  return text;
}

}  // namespace

std::string HowFarToTrust::header() const {
  std::string text = std::isnan(reduced_chi2) ? std::string() : fmt::format(",{}", chi2_column);
  for (const std::string& warning : warnings) text += fmt::format(",{}{}", warning_column, as_name(warning));
  return text;
}

std::string HowFarToTrust::cells() const {
  std::string text = std::isnan(reduced_chi2) ? std::string() : fmt::format(",{:.4g}", reduced_chi2);
  for (std::size_t i = 0; i < warnings.size(); ++i) text += ",1";
  return text;
}

HowFarToTrust HowFarToTrust::of_table(const CsvTable& table) {
  HowFarToTrust trust{std::numeric_limits<double>::quiet_NaN(), {}};
  for (const CsvColumn& column : table.columns) {
    if (column.name == chi2_column && column.value.size() > 0) trust.reduced_chi2 = column.value[0];
    if (column.name.starts_with(warning_column)) trust.warnings.push_back(column.name.substr(warning_column.size()));
  }
  return trust;
}

bool HowFarToTrust::is_wrong() const {
  return reduced_chi2 > explained || std::any_of(warnings.begin(), warnings.end(), [](const std::string& w) { return w.find(wrong) != std::string::npos; });
}

}  // namespace unrig
