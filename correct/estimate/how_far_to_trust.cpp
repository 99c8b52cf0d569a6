#include "correct/estimate/how_far_to_trust.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <fmt/format.h>

#include "fit/likelihood/explained.h"

namespace unrig {
namespace {

constexpr const char* chi2_column = "reduced_chi2";
constexpr std::string_view warning_column = "warning: ", no_answer_column = "no answer: ";

/// What no reader of a header takes for anything but text.
std::string as_name(std::string text) {
  for (const auto& [sign, instead] : {std::pair{',', ';'}, {'"', '\''}, {'[', '('}, {']', ')'}, {'\n', ' '}, {'#', '?'}}) std::replace(text.begin(), text.end(), sign, instead);
  return text;
}

}  // namespace

std::string HowFarToTrust::header() const {
  std::string text = std::isnan(reduced_chi2) ? std::string() : fmt::format(",{}", chi2_column);
  for (const std::string& warning : warnings) text += fmt::format(",{}{}", warning_column, as_name(warning));
  if (!no_answer.empty()) text += fmt::format(",{}{}", no_answer_column, as_name(no_answer));
  if (const std::string column = made_by.column(); !column.empty()) text += "," + as_name(column);
  return text;
}

std::string HowFarToTrust::cells() const {
  std::string text = std::isnan(reduced_chi2) ? std::string() : fmt::format(",{:.4g}", reduced_chi2);
  for (std::size_t i = 0; i < warnings.size(); ++i) text += ",1";
  if (!no_answer.empty()) text += ",1";
  return made_by.column().empty() ? text : text + ",1";
}

bool HowFarToTrust::misses_something(Eigen::Index samples) const {
  constexpr Eigen::Index channels = 2;
  return reduced_chi2 > most_of_noise(channels * samples);
}

HowFarToTrust HowFarToTrust::of_table(const CsvTable& table) {
  HowFarToTrust trust{std::numeric_limits<double>::quiet_NaN(), {}, {}, {}};
  for (const CsvColumn& column : table.columns) {
    if (column.name == chi2_column && column.value.size() > 0) trust.reduced_chi2 = column.value[0];
    const std::string name = column.unit.empty() ? column.name : fmt::format("{} ({})", column.name, column.unit);  // brackets at the end of a text are no unit
    if (name.starts_with(warning_column)) trust.warnings.push_back(name.substr(warning_column.size()));
    if (name.starts_with(MadeBy::prefix)) trust.made_by = MadeBy::of_column(std::string_view(name).substr(MadeBy::prefix.size()));
    if (name.starts_with(no_answer_column)) trust.no_answer = name.substr(no_answer_column.size());
  }
  return trust;
}

}  // namespace unrig
