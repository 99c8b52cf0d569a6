#include "fit/diagnose/reliability.h"

#include <algorithm>
#include <utility>

#include "core/law/law_effect.h"

namespace unrig {
namespace {

/// Of so many campaigns with such a verdict. One was right and one was wrong before any was seen (Laplace's rule of succession).
struct Count {
  double right = 0, all = 0;
  double share() const { return (right + 1) / (all + 2); }
};

// tests/studies/TRIAL.md, "How often a verdict is right".
constexpr Count one_of_the_list{116, 119};  // an effect of the list by itself, which leaves nothing
constexpr Count several{6, 6};              // more than one name; nothing is left
constexpr Count formula{0, 2};              // a law on no list, by itself: all that was hidden is on the list
constexpr Count description_alone{1, 4};    // the rig's description by itself: an effect may hide behind it
constexpr Count with_a_rest{8, 8};          // names, and something remains unexplained
constexpr Count nothing_seen{27, 31};

}  // namespace

double share_of_right(const Diagnosis& d) {
  if (d.missing.empty()) return nothing_seen.share();
  if (d.unexplained) return with_a_rest.share();
  if (d.missing.size() > 1) return several.share();
  const std::string& name = d.missing.front().effect;
  if (name == rig_description_id) return description_alone.share();
  return is_law_id(name) ? formula.share() : one_of_the_list.share();
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
