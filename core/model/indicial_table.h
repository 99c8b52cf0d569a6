#pragma once
#include <Eigen/Core>
#include <optional>
#include <string>

#include "core/model/wagner.h"

namespace unrig {

/// Rates evenly spread over ln s, from 1 / `semichords` to 6 per semichord, a factor of about 1.7 apart, 3 to 16 of them: Wagner's function, and any
/// other that varies on a logarithmic scale, is within 1e-4 of a sum of such exponentials. A single exponential between two rates is what asks for so many: a
/// factor of 2.5 misses it by 1e-3, and where the limit is extrapolated from the end of a record that became 1 % of the response.
Eigen::VectorXd spread_rates(double semichords);

/// Amplitudes A_k with which 1 - sum A_k exp(-rate_k s) comes nearest to phi at these s (least squares; where they are not determined, the
/// smallest).
Eigen::VectorXd nearest_amplitudes(const Eigen::VectorXd& rates, const Eigen::VectorXd& semichords, const Eigen::VectorXd& phi);

/// An indicial response out of a table.
struct TabulatedIndicial {
  IndicialFunction function;
  std::optional<double> slope;  ///< normal-force slope per radian, where the table has it
  double miss = 0;              ///< largest distance of the function from the table
};

/// Reads `indicial.csv` as `unrig correct` writes it, or any table with columns `semichords` and `indicial` (1 at infinity), as the nearest sum of exponentials.
/// The slope is cn_per_radian over indicial where that column is there. Throws InputError for other files, semichords that do not increase, and a table that
/// no such sum comes nearer to than 0.05.
TabulatedIndicial read_indicial(const std::string& path);

}  // namespace unrig
