#pragma once
#include <Eigen/Core>
#include <string>
#include <vector>

#include "fit/fit.h"

namespace unrig {

/// What an error of the numbers that nobody states an uncertainty of would do to a fit.
struct Price {
  std::string group;       ///< "normal.mass": all of them by the same part
  double per_cent = 1;     ///< by so much; of the clock a tenth
  Eigen::VectorXd change;  ///< of each of `PriceList::names`, per cent of itself
};
struct PriceList {
  std::vector<std::string> names;  ///< shared parameters that the fit determines, then the slope of the normal force and the load at the end of a step, as means over the runs
  std::vector<Price> prices;
};

/// One step of the fit per group, linearised at `result`; nothing moves by itself. Throws std::invalid_argument where `result` is not of that problem.
PriceList price_of_numbers(const FitProblem& problem, const FitResult& result);

std::string report(const PriceList& list);

}  // namespace unrig
