#pragma once
#include <functional>
#include <string>
#include <vector>

#include "core/law/law.h"
#include "fit/fit.h"
#include "fit/laws/law_search.h"

namespace unrig {

/// Another set of effects that these runs cannot refute.
struct Rival {
  std::vector<std::string> effects;  ///< all that is at work; laws by their id
  std::string force, memory;         ///< of the law that stands in place of the one found; of a listed effect its equation
  std::string text;                  ///< law file with the values that were found as starts; empty of a listed effect
  double distance = 0;               ///< standard deviations: square root of the difference of -2 ln likelihood, 0 where the rival's is higher
  double log_odds = 0;               ///< ln of the odds for what was found, by BIC
};

/// A law with what goes with it.
struct FoundLaw {
  Law law;  ///< parameters start where the fit found them; learnt on how far the fitted runs went
  std::vector<Rival> rivals;
};

/// The law `id` of `rig`, at the values of a fit.
FoundLaw found_law(const Rig& rig, const std::string& id, const FitResult& fit);

/// Of all sets that were tried those that leave nothing and whose evidence is not decisively less than that of the best, which stands first and is none of them.
std::vector<Rival> rivals(const std::vector<Trial>& tried, const std::function<bool(const Trial&)>& leaves_something);

}  // namespace unrig
