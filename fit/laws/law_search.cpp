#include "fit/laws/law_search.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <optional>
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
constexpr double half_of_it = 0.5;  // of what the best promises or explains: what is less does not come out ahead among thousands of samples

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

/// Whether there is a mismatch in the decays, of which the states that they ask for can tell.
bool shows_in_decays(const Trial& base) { return has_decays(base.arrival.joint) && left_of_decays(base) > explained; }

}  // namespace

LawSearch::LawSearch(FitProblem& problem, const Trial& base, std::function<bool(const Trial&)> leaves_something, Listed listed)
    : problem_(problem), base_(base), leaves_something_(std::move(leaves_something)), listed_(listed) {}

/// Ids of the forms that explain most, which the rig gets.
std::vector<std::string> LawSearch::forms_worth_a_fit(const Trial& base) {
  const bool by_decays = shows_in_decays(base);
  const BesideUnknownForces beside = beside_unknown_forces(base.arrival.joint);
  const std::vector<Form> forms = dictionary(problem_.rig, reach_of(beside));
  std::vector<Screened> screened(forms.size());
  if (by_decays) screened = screen(forms, beside);
  std::vector<std::size_t> order;
  for (std::size_t i = 0; i < forms.size(); ++i)
    if (by_decays ? screened[i].gain > 0 : forms[i].law.acts_on == ActsOn::lift) order.push_back(i);
  sort_by(order, [&](std::size_t i) { return -screened[i].gain; });
  if (order.size() > most_in_full) order.resize(most_in_full);
  std::erase_if(order, [&](std::size_t i) { return screened[i].gain < half_of_it * screened[order.front()].gain; });

  problem_.rig.laws = base.arrival.joint.model().rig().laws;  // the rig may have got others since
  std::erase_if(problem_.rig.laws, [&](const auto& law) { return !is_among(base.effects, law->id); });
  std::vector<std::string> ids;
  for (const std::size_t i : order) {
    Form form = forms[i];
    if (by_decays) form.starts = {screened[i].start};
    const std::shared_ptr<const Effect> law = as_effect(form);
    if (is_among(base.effects, law->id)) continue;
    problem_.rig.laws.push_back(law);
    ids.push_back(law->id);
  }
  return ids;
}

/// Effects of the list that may be at work beside `base`; of those that are tried only where they are named the ones that are of the kind of a form.
std::vector<std::string> LawSearch::of_the_list(const std::vector<std::string>& forms, const Trial& base) const {
  std::vector<std::string> kinds;
  for (const std::string& id : forms) kinds.push_back(effect(problem_.rig, id).kind);
  std::vector<Conditions> conditions;
  for (const RunResidual& run : base.arrival.joint.runs()) conditions.push_back(run.conditions());
  std::vector<std::string> ids;
  for (const Effect& e : effects()) {
    const bool wanted = e.only_if_named.empty() ? listed_ == Listed::all : is_among(kinds, e.kind);
    if (wanted && !is_among(base.effects, e.id) && why_idle(e, problem_.rig, conditions).empty()) ids.push_back(e.id);
  }
  return ids;
}

/// Laws of the list and of the dictionary. Before anything else was tried: where one of them promises most of all effects to first order those of the list that promise half as much, and forms where one of them does.
LawSearch::Prospects LawSearch::prospects(const Trial& base) {
  if (problem_.progress) problem_.progress("looking for the law of what is missing" + (base.effects.empty() ? std::string() : " beside " + base.effects.back()));
  const std::vector<std::string> forms = forms_worth_a_fit(base);
  std::vector<std::string> added = of_the_list(forms, base);
  const std::size_t first_form = added.size();
  added.insert(added.end(), forms.begin(), forms.end());
  const Screening screening(problem_, base.arrival);
  std::vector<std::optional<Trial>> trials(added.size());
  in_parallel(trials.size(), [&](std::size_t i) {
    std::vector<std::string> set = base.effects;
    set.push_back(added[i]);
    trials[i] = screened(problem_, screening, base, set);
  });
  double best = 0, best_law = 0, best_form = 0;
  for (std::size_t i = 0; i < trials.size(); ++i) {
    best = std::max(best, trials[i]->score);
    if (brings_a_law(*trials[i])) best_law = std::max(best_law, trials[i]->score);
    if (i >= first_form) best_form = std::max(best_form, trials[i]->score);
  }
  if (listed_ == Listed::all && best_law < best) return {};
  Prospects all;
  for (std::size_t i = 0; i < trials.size(); ++i) {
    const bool is_form = i >= first_form;
    const bool worth_it = listed_ == Listed::only_if_named || ((is_form ? best_form : trials[i]->score) >= half_of_it * best && brings_a_law(*trials[i]));
    if (worth_it) (is_form ? all.forms : all.listed).push_back(std::move(*trials[i]));
  }
  return all;
}

/// Fitted in full, those that are worth it.
std::vector<Trial> LawSearch::followed(std::vector<Trial> tried, const Trial& base) const {
  const bool driven = all_driven(base.arrival.joint), by_decays = shows_in_decays(base);
  in_parallel(tried.size(), [&](std::size_t i) {
    hold_undetermined(tried[i]);
    if (driven) follow_nonlinear(problem_, tried[i], base, INFINITY);
    else if (by_decays && nonlinear(tried[i])) tried[i].ruled_out = !fit_decays_first(tried[i], base, true);
  });
  // Of thousands of samples twice the excess of another is beyond any evidence.
  const auto excess = [](const Trial& t) { return std::max(0.0, left_of_decays(t) - 1); };
  double least = INFINITY;
  for (const Trial& t : tried)
    if (by_decays && !t.ruled_out) least = std::min(least, std::max(excess(t), explained - 1));
  std::erase_if(tried, [&](const Trial& t) { return t.ruled_out || (by_decays && excess(t) > 2 * least); });
  in_parallel(tried.size(), [&](std::size_t i) {
    if (!driven) follow_further(tried[i], INFINITY);
  });
  sort_by(tried, [&](const Trial& t) { return bic_difference(t, base_); });
  return tried;
}

/// Whether the best of these, the first, asks for another law beside it.
bool LawSearch::goes_on(const std::vector<Trial>& tried) const {
  return !tried.empty() && tried.front().effects.size() < most_effects && leaves_something_(tried.front()) && bic_difference(tried.front(), base_) < 0;
}

/// Whether forms may explain what laws of the list do not, or as well: no rivals are looked for of one that leaves nothing of a mismatch too large for two laws to explain alike, unless it is tried only where it is named,
/// and so rare that forms are as likely.
bool LawSearch::may_have_rivals(const std::vector<Trial>& tried) const {
  if (listed_ == Listed::only_if_named || base_.reduced_chi2() < nearly_explained) return true;
  return std::none_of(tried.begin(), tried.end(), [&](const Trial& t) { return effect(problem_.rig, t.effects.back()).only_if_named.empty() && !leaves_something_(t); });
}

std::vector<Trial> LawSearch::search() {
  Prospects alone = prospects(base_);
  std::vector<Trial> all = followed(std::move(alone.listed), base_);
  const auto add = [&](std::vector<Trial> more) { std::move(more.begin(), more.end(), std::back_inserter(all)); };
  if (listed_ == Listed::all && goes_on(all) && all.front().excess() < half_of_it * base_.excess()) {
    const Trial first = all.front();
    add(followed(prospects(first).listed, first));
  }
  if (may_have_rivals(all)) {
    add(followed(std::move(alone.forms), base_));
    sort_by(all, [&](const Trial& t) { return bic_difference(t, base_); });
    if (goes_on(all)) {
      const Trial first = all.front();
      Prospects pairs = prospects(first);
      std::move(pairs.forms.begin(), pairs.forms.end(), std::back_inserter(pairs.listed));
      add(followed(std::move(pairs.listed), first));
    }
  }
  sort_by(all, [&](const Trial& t) { return bic_difference(t, base_); });
  if (!all.empty() && all.front().effects.size() > 1) {
    problem_.rig.laws = all.front().arrival.joint.model().rig().laws;
    add(taken_away(problem_, all.front()));
  }
  in_parallel(all.size(), [&](std::size_t i) {  // rivals are told apart by less than where a search among many ends
    if (!leaves_nothing(all[i]) && i > 0) return;
    all[i].arrival.joint.solve({});
    measure(all[i]);
  });
  sort_by(all, [&](const Trial& t) { return bic_difference(t, base_); });
  return all;
}

}  // namespace unrig
