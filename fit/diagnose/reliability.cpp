#include "fit/diagnose/reliability.h"

#include <algorithm>
#include <array>
#include <utility>

namespace unrig {
namespace {

/// Of so many campaigns with such a verdict. One was right and one was wrong before any was seen (Laplace's rule of succession).
struct Count {
  double right = 0, all = 0;
  double share() const { return (right + 1) / (all + 2); }
};

// tests/studies/TRIAL.md, "How often a verdict is right".
constexpr std::array<Count, 3> by_names{Count{0, 0}, Count{0, 0}, Count{0, 0}};  // one effect is named, two, three
constexpr Count with_a_rest{0, 0};                                              // something is named, and something remains unexplained
constexpr Count nothing_seen{0, 0};

}  // namespace

double share_of_right(const Diagnosis& d) {
  if (d.missing.empty()) return nothing_seen.share();
  if (d.unexplained) return with_a_rest.share();
  return by_names[std::min(d.missing.size(), by_names.size()) - 1].share();
}

std::vector<StatedExplanation> explanations_of(const Diagnosis& d) {
  if (d.missing.empty() && d.unexplained) return {{{something_else}, 1}};
  std::vector<StatedExplanation> all;
  const double right = share_of_right(d);
  double told = 0;
  if (d.missing.empty()) all.push_back({{}, told = right});
  else
    for (const Candidate& c : d.ranking)
      if (c.probability > 0) all.push_back({c.effects, right * c.probability}), told += all.back().probability;
  all.push_back({{something_else}, 1 - told});
  std::stable_sort(all.begin(), all.end(), [](const StatedExplanation& a, const StatedExplanation& b) { return a.probability > b.probability; });
  double held = 0;
  std::size_t few = 0;
  while (few < all.size() && held < explanations_hold) held += all[few++].probability;
  all.resize(few);
  return all;
}

}  // namespace unrig
