#pragma once
#include <string>

#include "fit/fit.h"

namespace unrig {

/// Text report: statistics, variables with error, percentage and start value, correlations of at least `least`, runs.
std::string report(const FitResult& result, double least = 0.1);

}  // namespace unrig
