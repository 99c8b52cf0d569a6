#include "correct/how_far_to_trust.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <fmt/format.h>

namespace unrig {
namespace {

constexpr const char *chi2_column = "reduced_chi2", *warning_column = "warning";

std::string as_cell(std::string text) {
  std::replace(text.begin(), text.end(), ',', ';');
  std::replace(text.begin(), text.end(), '"', '\'');
  std::replace(text.begin(), text.end(), '\n', ' ');
  return text;
}

std::string_view unquoted(std::string_view cell) {
  while (!cell.empty() && (cell.back() == '\r' || cell.back() == '"' || cell.back() == ' ')) cell.remove_suffix(1);
  while (!cell.empty() && (cell.front() == '"' || cell.front() == ' ')) cell.remove_prefix(1);
  return cell;
}

}  // namespace

std::string HowFarToTrust::header() const {
  return (std::isnan(reduced_chi2) ? std::string() : fmt::format(",{}", chi2_column)) + (warnings.empty() ? std::string() : fmt::format(",{}", warning_column));
}

std::string HowFarToTrust::cells(std::size_t k) const {
  std::string text = std::isnan(reduced_chi2) ? std::string() : fmt::format(",{:.4g}", reduced_chi2);
  if (!warnings.empty()) text += "," + (k < warnings.size() ? as_cell(warnings[k]) : std::string());
  return text;
}

HowFarToTrust HowFarToTrust::of_table(const CsvTable& table, std::string_view text) {
  HowFarToTrust trust{std::numeric_limits<double>::quiet_NaN(), {}};
  for (const CsvColumn& column : table.columns)
    if (column.name == chi2_column && column.value.size() > 0) trust.reduced_chi2 = column.value[0];
  if (table.columns.back().name != warning_column) return trust;
  text.remove_prefix(std::min(text.size(), text.find('\n')));
  while (!text.empty()) {
    text.remove_prefix(1);
    const std::string_view line = text.substr(0, text.find('\n')), cell = unquoted(line.substr(line.rfind(',') + 1));
    if (cell.empty()) break;
    trust.warnings.emplace_back(cell);
    text.remove_prefix(line.size());
  }
  return trust;
}

bool HowFarToTrust::is_wrong() const {
  return reduced_chi2 > explained || std::any_of(warnings.begin(), warnings.end(), [](const std::string& w) { return w.find(wrong) != std::string::npos; });
}

}  // namespace unrig
