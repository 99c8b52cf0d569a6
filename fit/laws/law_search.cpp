#include "fit/laws/law_search.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <memory>
#include <string>
#include <utility>

#include <fmt/format.h>

#include "core/effects/effect.h"
#include "core/law/law_effect.h"
#include "core/numerics/in_parallel.h"
#include "fit/laws/screen.h"
#include "fit/search/decays_first.h"

namespace unrig {
namespace {

constexpr std::size_t most_in_full = 5;

/// Ascending in a number that is asked for once of each; what is none comes last.
template <class T, class Key>
void sort_by(std::vector<T>& all, Key key) {
  std::vector<std::pair<double, std::size_t>> order;
  for (std::size_t i = 0; i < all.size(); ++i) {
    const double k = key(all[i]);
    order.emplace_back(std::isnan(k) ? INFINITY : k, i);
  }
  std::stable_sort(order.begin(), order.end());
  std::vector<T> sorted;
  for (const auto& [k, i] : order) sorted.push_back(std::move(all[i]));
  all = std::move(sorted);
}

bool is_among(const std::vector<std::string>& ids, const std::string& id) { return std::find(ids.begin(), ids.end(), id) != ids.end(); }

}  // namespace

LawSearch::LawSearch(FitProblem& problem, const Trial& base, std::function<bool(const Trial&)> leaves_something) : problem_(problem), base_(base), leaves_something_(std::move(leaves_something)) {}

std::vector<Trial> LawSearch::one_more(const Trial& base) {
  const bool driven = all_driven(base.arrival.joint);
  const bool by_decays = has_decays(base.arrival.joint) && left_of_decays(base) > explained;
  if (problem_.progress) problem_.progress("looking for the law of what is missing" + (base.effects.empty() ? std::string() : " beside " + base.effects.back()));
  const BesideUnknownForces beside = beside_unknown_forces(base.arrival.joint);
  const std::vector<Form> forms = dictionary(problem_.rig, reach_of(beside));
  std::vector<Screened> screened(forms.size());
  if (by_decays) screened = screen(forms, beside);
  std::vector<std::size_t> order;
  for (std::size_t i = 0; i < forms.size(); ++i)
    if (by_decays ? screened[i].gain > 0 : forms[i].law.acts_on == ActsOn::lift) order.push_back(i);
  sort_by(order, [&](std::size_t i) { return -screened[i].gain; });
  if (order.size() > most_in_full) order.resize(most_in_full);

  std::erase_if(problem_.rig.laws, [&](const auto& law) { return !is_among(base.effects, law->id); });
  std::vector<std::string> added, kinds;
  for (const std::size_t i : order) {
    Form form = forms[i];
    if (by_decays) form.starts = {screened[i].start};
    const std::shared_ptr<const Effect> law = as_effect(form);
    if (is_among(base.effects, law->id)) continue;
    problem_.rig.laws.push_back(law);
    added.push_back(law->id);
    kinds.push_back(law->kind);
  }
  std::vector<Conditions> conditions;
  for (const RunResidual& run : base.arrival.joint.runs()) conditions.push_back(run.conditions());
  for (const Effect& e : effects())
    if (!e.only_if_named.empty() && is_among(kinds, e.kind) && !is_among(base.effects, e.id) && why_idle(e, problem_.rig, conditions).empty()) added.push_back(e.id);

  const Screening screening(problem_, base.arrival);
  std::vector<std::unique_ptr<Trial>> tried(added.size());
  in_parallel(tried.size(), [&](std::size_t i) {
    std::vector<std::string> set = base.effects;
    set.push_back(added[i]);
    tried[i] = std::make_unique<Trial>(prepare(problem_, screening, base, set));
    if (driven) follow_nonlinear(problem_, *tried[i], base, INFINITY);
    else if (by_decays && nonlinear(*tried[i])) tried[i]->ruled_out = !fit_decays_first(*tried[i], base, true);
  });
  // Of thousands of samples twice the excess of another is beyond any evidence.
  const auto excess = [](const Trial& t) { return std::max(0.0, left_of_decays(t) - 1); };
  double least = INFINITY;
  for (const auto& t : tried)
    if (by_decays && !t->ruled_out) least = std::min(least, std::max(excess(*t), explained - 1));
  for (const auto& t : tried) t->ruled_out = t->ruled_out || (by_decays && excess(*t) > 2 * least);
  in_parallel(tried.size(), [&](std::size_t i) {
    if (!tried[i]->ruled_out && !driven) follow_further(*tried[i], INFINITY);
  });
  std::vector<Trial> fitted;
  for (auto& one : tried)
    if (!one->ruled_out) fitted.push_back(std::move(*one));
  sort_by(fitted, [&](const Trial& t) { return bic_difference(t, base_); });
  return fitted;
}

std::vector<Trial> LawSearch::search() {
  std::vector<Trial> all = one_more(base_);
  if (!all.empty() && all.front().effects.size() < most_effects && leaves_something_(all.front()) && bic_difference(all.front(), base_) < 0) {
    const Trial first = all.front();
    std::vector<Trial> pairs = one_more(first);
    std::move(pairs.begin(), pairs.end(), std::back_inserter(all));
  }
  in_parallel(all.size(), [&](std::size_t i) {  // rivals are told apart by less than where a search among many ends
    if (!leaves_nothing(all[i])) return;
    all[i].arrival.joint.solve({});
    measure(all[i]);
  });
  sort_by(all, [&](const Trial& t) { return bic_difference(t, base_); });
  return all;
}

}  // namespace unrig
