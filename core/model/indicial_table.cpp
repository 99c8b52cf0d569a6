#include "core/model/indicial_table.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "core/files/csv_table.h"
#include "core/files/text_file.h"

namespace unrig {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

VectorXd spread_rates(double semichords) {
  constexpr double fastest = 6, factor = 1.7;
  const double slowest = 1 / semichords;
  const auto count = static_cast<Index>(std::round(std::log(fastest / slowest) / std::log(factor))) + 1;
  VectorXd rates(std::clamp<Index>(count, 3, 16));
  for (Index k = 0; k < rates.size(); ++k) rates[k] = slowest * std::pow(fastest / slowest, static_cast<double>(k) / static_cast<double>(rates.size() - 1));
  return rates;
}

VectorXd nearest_amplitudes(const VectorXd& rates, const VectorXd& semichords, const VectorXd& phi) {
  MatrixXd basis(semichords.size(), rates.size());
  for (Index k = 0; k < rates.size(); ++k) basis.col(k) = (-rates[k] * semichords).array().exp();
  // The ridge keeps amplitudes small where neighbouring rates cannot be told apart; it costs less than 1e-4 of phi.
  const MatrixXd ridge = basis.transpose() * basis + 1e-8 * static_cast<double>(semichords.size()) * MatrixXd::Identity(rates.size(), rates.size());
  return ridge.ldlt().solve(basis.transpose() * (1 - phi.array()).matrix());
}

TabulatedIndicial read_indicial(const std::string& path) {
  const std::string text = read_text(path);
  const CsvTable table = read_csv(text, 1, path);
  const auto find = [&](const std::string& name) -> const CsvColumn* {
    const auto found = std::find_if(table.columns.begin(), table.columns.end(), [&](const CsvColumn& c) { return c.name == name; });
    return found == table.columns.end() ? nullptr : &*found;
  };
  const CsvColumn *semichords = find("semichords"), *indicial = find("indicial");
  const char* wanted = "wanted the columns semichords and indicial of an indicial response";
  if (!semichords || !indicial) throw InputError({path, 1}, "no column \"semichords\" or no column \"indicial\"", wanted, "Give the file that `unrig correct --indicial` wrote.");
  const VectorXd &s = semichords->value, &phi = indicial->value;
  for (Index i = 0; i < s.size(); ++i) {
    const bool increases = i == 0 ? s[i] >= 0 : s[i] > s[i - 1];
    if (!increases || !std::isfinite(s[i]) || !std::isfinite(phi[i])) throw InputError(table.place(i), "not a number, or semichords that do not increase", wanted, "");
  }
  if (s.size() < 3) throw InputError({path, 1}, fmt::format("{} rows", s.size()), "wanted three at least", "");

  TabulatedIndicial result;
  result.function.name = "tabulated";
  result.function.rate = spread_rates(s[s.size() - 1]);
  result.function.amplitude = nearest_amplitudes(result.function.rate, s, phi);
  for (Index i = 0; i < s.size(); ++i) result.miss = std::max(result.miss, std::abs(result.function(s[i]) - phi[i]));
  constexpr double too_far = 0.05;
  if (result.miss > too_far)
    throw InputError({path, 1}, fmt::format("the response is off the nearest sum of exponentials by {:.2g}", result.miss), "wanted one that varies on a logarithmic scale and ends at 1", "");
  if (const CsvColumn* lift = find("cn_per_radian")) result.slope = lift->value[s.size() - 1] / phi[s.size() - 1];
  return result;
}

}  // namespace unrig
