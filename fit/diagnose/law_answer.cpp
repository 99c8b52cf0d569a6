#include "fit/diagnose/law_answer.h"

#include <algorithm>
#include <iterator>
#include <utility>

#include "core/effects/effect.h"
#include "core/law/law_effect.h"
#include "core/numerics/in_parallel.h"
#include "fit/fit_description.h"
#include "fit/search/noise_of_trial.h"

namespace unrig {
namespace {

bool leaves_something(const Trial& t) { return what_remains(t).found; }

bool is_listed(const Trial& t) { return !is_law_id(t.effects.back()); }

bool is_no_curve(const Trial& t) { return is_listed(t) || !law_of(effect(t.arrival.joint.model().rig(), t.effects.back())).is_curve(); }

}  // namespace

bool is_undetermined(const FitProblem& problem, const Trial& set) {
  FitProblem with = problem;
  with.effects = set.effects;
  with.rig.laws = set.arrival.joint.model().rig().laws;
  Arrival arrival = set.arrival;
  arrival.converged = true;  // wherever the search ended
  const FitResult fit = describe_fit(arrival, with, Settle::nothing);
  const auto is_of = [&](const std::string& id, std::size_t i) { return fit.parameters[i].effect == id; };
  // Of free decays, say, in proportion to a mass.
  const auto is_told_with_others = [&](const std::string& id, std::size_t i) {
    return std::any_of(fit.determined.begin(), fit.determined.end(), [&](const DeterminedCombination& c) {
      return c.unknowns.front() == i && std::none_of(c.unknowns.begin() + 1, c.unknowns.end(), [&](std::size_t other) { return is_of(id, other); });
    });
  };
  return std::any_of(set.effects.begin(), set.effects.end(), [&](const std::string& id) {
    bool has_any = false;
    for (std::size_t i = 0; i < fit.parameters.size(); ++i) {
      if (!is_of(id, i)) continue;
      has_any = true;
      const FittedParameter& p = fit.parameters[i];
      if (p.std_error < std::abs(p.value) && (p.identified || is_told_with_others(id, i))) return false;
    }
    return has_any;
  });
}

bool none_leaves_nothing(const std::vector<Trial>& tried) { return std::all_of(tried.begin(), tried.end(), leaves_something); }

LawsTried search_laws(FitProblem& fit_problem, const Trial& baseline, const Trial& base, LawSearch::Among among, const LawSearch::Asked& is_no_law, Selection& selection, LawSearch::Known known) {
  if (base.effects.empty()) known.screened = selection.screened_alone();
  LawSearch search(fit_problem, base, leaves_something, is_no_law, among, std::move(known));
  LawsTried found{search.search(), search.asked_forms()};
  for (const Trial& t : found.tried) selection.add({t.effects, t.reduced_chi2(), bic_difference(t, baseline), 0, 0});
  for (const Trial& t : search.refuted()) selection.add({t.effects, t.reduced_chi2(), bic_difference(t, baseline), 0, 0, SearchOutcome::ruled_out});
  return found;
}

std::vector<Trial> in_noise_of(const Trial& first, const std::vector<Trial>& tried, const Trial& baseline, Selection& selection) {
  std::vector<Trial> anew;
  for (const Trial& t : tried)
    if (t.excess() <= 2 * tried.front().excess()) anew.push_back(t);
  in_parallel(anew.size(), [&](std::size_t i) {
    take_noise_of(anew[i], first);
    if (leaves_nothing(anew[i]) && !decays_decide(anew[i])) leave_out_terms(anew[i]);  // in white noise they left something
  });
  std::stable_sort(anew.begin(), anew.end(), [](const Trial& a, const Trial& b) { return bic_difference(a, b) < 0; });
  for (const Trial& t : anew) selection.add({t.effects, t.reduced_chi2(), bic_difference(t, baseline), 0, 0});
  return anew;
}

std::optional<Laws> choose_law(const DiagnoseProblem& problem, FitProblem& fit_problem, const Setting& files, const Trial& baseline, std::vector<Trial> tried, const Selection& selection, FoundSet& found) {
  Laws laws{std::move(tried), {}};
  std::stable_sort(laws.tried.begin(), laws.tried.end(), [](const Trial& a, const Trial& b) { return bic_difference(a, b) < 0; });
  fit_problem.rig.laws.clear();
  std::vector<Trial> undetermined;  // no answers, but not refuted either
  while (!laws.tried.empty() && is_undetermined(fit_problem, laws.tried.front())) {
    undetermined.push_back(std::move(laws.tried.front()));
    laws.tried.erase(laws.tried.begin());
  }
  if (laws.tried.empty()) return std::nullopt;
  const auto rest = std::stable_partition(laws.tried.begin(), laws.tried.end(), [](const Trial& t) { return !leaves_something(t); });
  const auto last = rest == laws.tried.begin() ? laws.tried.end() : rest;
  // Of what no evidence decides between a formula goes before a curve, and an effect of the list before both.
  for (const auto& goes_first : {is_no_curve, is_listed})
    if (const auto first = std::find_if(laws.tried.begin(), last, goes_first); first != last && bic_difference(*first, laws.tried.front()) < decisive) std::rotate(laws.tried.begin(), first, first + 1);
  fit_problem.rig.laws = laws.tried.front().arrival.joint.model().rig().laws;
  FoundSet with = look_at(problem, files, baseline, files, laws.tried.front(), 0);
  const bool holds = with.clean() || bic_difference(with.best, baseline) < selection.ranking().front().delta_bic + decisive;
  if (naming_of(with.best, baseline, with.clean(), with.predicts) != Naming::named || !holds || !(bic_difference(with.best, found.best) < -decisive)) {
    fit_problem.rig.laws.clear();
    return std::nullopt;
  }
  found = std::move(with);
  laws.tried.insert(laws.tried.begin() + 1, std::make_move_iterator(undetermined.begin()), std::make_move_iterator(undetermined.end()));
  laws.rivals = rivals(laws.tried, leaves_something);
  return laws;
}

void tell_laws(FitProblem& fit_problem, const Laws& laws, const FoundSet& found, std::vector<MissingEffect>& set, Diagnosis& d) {
  for (MissingEffect& m : set)
    if (is_law_id(m.effect)) {
      m.law = found_law(fit_problem.rig, m.effect, found.fit);
      if (m.effect == found.best.effects.back()) m.law->rivals = laws.rivals;
    }
  std::erase_if(fit_problem.rig.laws, [&](const auto& law) { return std::find(found.best.effects.begin(), found.best.effects.end(), law->id) == found.best.effects.end(); });
  d.laws = fit_problem.rig.laws;
}

}  // namespace unrig
