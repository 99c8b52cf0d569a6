#pragma once
#include <string>

#include "fit/search/arrival.h"

namespace unrig {

/// A search may end far from where it began, and worse: where chi-square at the problem's start values, under the same noise, is less than where the fit stands, it goes back there and
/// searches from there. Returns what a user should know of that; empty where the fit stands as it was.
std::string no_worse_than_start(Arrival& arrival, const FitProblem& problem);

}  // namespace unrig
