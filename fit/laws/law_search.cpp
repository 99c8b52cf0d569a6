#include "fit/laws/law_search.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <numeric>
#include <optional>
#include <string>
#include <utility>

#include <fmt/format.h>

#include "core/effects/effect.h"
#include "core/law/law_effect.h"
#include "core/numerics/in_parallel.h"
#include "core/numerics/time_limit.h"
#include "fit/laws/curve_of_state.h"
#include "fit/laws/screen.h"
#include "fit/search/decays_first.h"
#include "fit/search/left_of_runs.h"
#include "fit/search/lost_run.h"

namespace unrig {
namespace {

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

/// Whether the model does not stay finite in one of the runs, those that were not followed behind the decays, or its slopes do not.
bool runs_away(const Trial& trial) {
  const bool far_off = std::any_of(trial.variance.begin(), trial.variance.end(), [](double variance) { return !(variance < run_away); });
  return far_off || !trial.arrival.joint.linearise().jacobian.allFinite();
}

bool is_among(const std::vector<std::string>& ids, const std::string& id) { return std::find(ids.begin(), ids.end(), id) != ids.end(); }

/// Where the parameters of a form stand; those that no run asks for at its first start.
Eigen::VectorXd values_of(const JointProblem& joint, const Form& form, const std::string& id) {
  Eigen::VectorXd values = form.starts.front();
  for (const Unknown& u : joint.unknowns())
    if (const Parameter& p = joint.parameter(u); p.effect == id) values[p.place] = u.value;
  return values;
}

/// Whether there is a mismatch in the decays, of which the states that they ask for can tell.
bool shows_in_decays(const Trial& base) { return has_decays(base.arrival.joint) && left_of_decays(base) > explained; }

double samples_of(const Trial& trial) { return std::accumulate(trial.samples.begin(), trial.samples.end(), 0.0); }

/// Where the search for the parameters of a form begins: at the coefficient, and where it is seen decisively at the shape, that the free decays ask for; otherwise at the shape at which it stands.
Eigen::VectorXd start_of(Form form, const BesideUnknownForces& beside) {
  const Screened here = screen({form}, beside).front();
  const Eigen::VectorXd start = here.gain > 0 ? here.start : form.starts.front();
  form.starts = shapes_of(form, Grid::fine);
  const Screened best = screen({form}, beside).front();
  return best.gain > decisive ? best.start : start;
}

}  // namespace

LawSearch::LawSearch(FitProblem& problem, const Trial& base, Asked leaves_something, Asked is_no_law, Among among, Known known)
    : problem_(problem), base_(base), leaves_something_(std::move(leaves_something)), is_no_law_(std::move(is_no_law)), among_(among), known_(std::move(known)) {}

/// What `which` of the forms promise to first order at the best of their starts, where they stand then; -inf for those at work and for all others. The rig gets these.
std::vector<double> LawSearch::screen_forms(const Trial& base, const Screening& screening, std::vector<Form>& forms, const std::vector<std::size_t>& which) {
  std::erase_if(problem_.rig.laws, [&](const auto& law) { return !is_among(base.effects, law->id); });
  for (const std::size_t i : which)
    if (!is_among(base.effects, forms[i].law.id())) problem_.rig.laws.push_back(as_effect(forms[i]));
  std::vector<double> promise(forms.size(), -INFINITY);
  in_parallel(which.size(), [&](std::size_t k) {
    Form& form = forms[which[k]];
    const std::string id = form.law.id();
    if (is_among(base.effects, id)) return;
    std::vector<std::string> set = base.effects;
    set.push_back(id);
    const Trial trial = screened(problem_, screening, base, set);
    promise[which[k]] = trial.score;
    form.starts = {values_of(trial.arrival.joint, form, id)};
  });
  return promise;
}

/// The rig has the laws at work in `base` from then on, and no others.
void LawSearch::keep_laws_of(const Trial& base) {
  problem_.rig.laws = base.arrival.joint.model().rig().laws;  // the rig may have got others since
  std::erase_if(problem_.rig.laws, [&](const auto& law) { return !is_among(base.effects, law->id); });
}

/// Ids of the forms that promise most to first order, which the rig gets. `known`: what is promised without them.
std::vector<std::string> LawSearch::forms_worth_a_fit(const Trial& base, const Promised& known) {
  const BesideUnknownForces beside = beside_unknown_forces(base.arrival.joint);
  std::vector<Form> forms = dictionary(problem_.rig, reach_of(beside));
  std::erase_if(forms, [](const Form& form) { return !form.listed.empty(); });
  keep_laws_of(base);
  const Screening screening(problem_, base.arrival);
  std::vector<std::size_t> all(forms.size());
  std::iota(all.begin(), all.end(), std::size_t{0});
  std::vector<Form> at_first = forms;
  for (Form& form : at_first) form.starts = shapes_of(form, Grid::first);
  const std::vector<double> at_first_shape = screen_forms(base, screening, at_first, all);
  // At its best shape a form promises up to some times of that.
  std::erase_if(all, [&](std::size_t i) { return !(at_first_shape[i] > quarter_of_it * std::max(known.by_a_law, known.by_a_signal)); });
  for (const std::size_t i : all) forms[i].starts = shapes_of(forms[i], Grid::coarse);
  const std::vector<double> promise = screen_forms(base, screening, forms, all);
  std::vector<std::size_t> order;
  for (std::size_t i = 0; i < forms.size(); ++i)
    if (promise[i] > 0) order.push_back(i);
  sort_by(order, [&](std::size_t i) { return -promise[i]; });
  if (order.size() > most_refits) order.resize(most_refits);
  std::erase_if(order, [&](std::size_t i) { return promise[i] < half_of_it * promise[order.front()]; });

  keep_laws_of(base);
  std::vector<std::string> worth_it;
  for (const std::size_t i : order) {
    Form form = forms[i];
    if (shows_in_decays(base)) form.starts = {start_of(form, beside)};
    problem_.rig.laws.push_back(as_effect(form));
    worth_it.push_back(form.law.id());
  }
  return worth_it;
}

/// What the decays ask for along these states: laws of the list and formulas of the dictionary, each where the regression has it. A formula's evidence is told with BIC for its parameters.
std::vector<LawSearch::AskedFor> LawSearch::asked_along(const BesideUnknownForces& beside) const {
  const Reach reach = reach_of(beside);
  const std::vector<std::string> of_list = of_the_list(base_);
  std::vector<Form> forms = laws_of_the_list(problem_.rig, reach);
  std::erase_if(forms, [&](const Form& form) { return !is_among(of_list, form.listed); });
  for (Form& form : dictionary(problem_.rig, reach))
    if (form.listed.empty()) forms.push_back(std::move(form));
  for (Form& form : forms) form.starts = shapes_of(form, Grid::fine);
  const std::vector<Screened> screened = screen(forms, beside);
  double without = INFINITY;
  for (const Screened& s : screened) without = std::min(without, s.deviance + s.gain);
  std::vector<AskedFor> asked;
  for (std::size_t i = 0; i < forms.size(); ++i) {
    if (!(screened[i].gain > decisive)) continue;
    forms[i].starts = {screened[i].start};
    const double evidence = without - screened[i].deviance - std::log(samples_of(base_)) * static_cast<double>(forms[i].law.parameters.size());
    asked.push_back({std::move(forms[i]), evidence});
  }
  return asked;
}

/// The most evident, and those with half of its evidence, in this order.
void LawSearch::keep_most_evident(std::vector<AskedFor>& asked) const {
  sort_by(asked, [](const AskedFor& a) { return -a.evidence; });
  if (!asked.empty()) std::erase_if(asked, [most = asked.front().evidence](const AskedFor& a) { return !(a.evidence > decisive) || a.evidence < half_of_it * most; });
  if (asked.size() > most_refits) asked.resize(most_refits);
}

/// The same along the states that the decays ask for with a curve at work, and the curve itself. False where there is none, or its first terms have less than half of the evidence of the best formula.
bool LawSearch::ask_for_a_curve() {
  const double least = asked_.empty() ? decisive : std::max(decisive, half_of_it * asked_.front().evidence);
  std::optional<CurveOfState> curve = curve_of_state(problem_, base_, *beside_, least);
  if (!curve) return false;
  asked_ = asked_along(curve->beside);
  keep_most_evident(asked_);
  asked_.push_back({std::move(curve->form), curve->evidence});
  return true;
}

/// The base with these laws of the list where the decays have them.
Trial LawSearch::begun_with(const std::vector<AskedFor>& asked) const {
  std::vector<std::string> set = base_.effects;
  for (const AskedFor& a : asked) set.push_back(a.form.listed);
  Trial trial{set, transferred(problem_, base_.arrival, std::make_shared<const AeroelasticModel>(model_of(problem_.rig, problem_.runs, problem_.circulation, set)))};
  for (const AskedFor& a : asked) {
    const Eigen::VectorXd values = as_listed(a.form, a.form.starts.front());
    for (Unknown* u : unknowns_of(trial.arrival.joint, a.form.listed)) {
      const Parameter& p = trial.arrival.joint.parameter(*u);
      u->value = std::clamp(values[p.place], p.lower, p.upper);
    }
  }
  return trial;
}

/// Effects of the list that may be at work beside `base`; among forms those that the dictionary has.
std::vector<std::string> LawSearch::of_the_list(const Trial& base) const {
  std::vector<Conditions> conditions;
  for (const RunResidual& run : base.arrival.joint.runs()) conditions.push_back(run.conditions());
  std::vector<std::string> ids;
  for (const Effect& e : effects())
    if (!is_among(base.effects, e.id) && why_idle(e, problem_.rig, conditions).empty()) ids.push_back(e.id);
  if (among_ == Among::forms) std::erase_if(ids, [forms = listed_forms()](const std::string& id) { return !is_among(forms, id); });
  return ids;
}

/// Each of `ids` beside the base of the search; those that were screened before as they were.
std::vector<Trial> LawSearch::screened_beside_base(const std::vector<std::string>& ids) const {
  const auto known = [&](const std::string& id) {
    const auto found = std::find_if(known_.screened.begin(), known_.screened.end(), [&](const Trial& t) { return t.effects.back() == id; });
    return found != known_.screened.end() ? &*found : nullptr;
  };
  std::vector<std::string> unknown;
  std::copy_if(ids.begin(), ids.end(), std::back_inserter(unknown), [&](const std::string& id) { return !known(id); });
  std::vector<Trial> anew = screened_beside(problem_, base_, unknown), all;
  auto next = anew.begin();
  for (const std::string& id : ids) all.push_back(known(id) ? *known(id) : std::move(*next++));
  return all;
}

/// Those that are worth a fit beside `base`: laws that promise the share `least` of what the best of all promises, and none where a signal promises more than any law. `known`: what was asked about before.
LawSearch::Prospects LawSearch::prospects(const Trial& base, std::vector<Trial> screened, const Promised& known, double least) const {
  std::vector<char> is_law;
  Prospects found{{}, known};
  for (const Trial& trial : screened) {
    is_law.push_back(brings_a_law(trial));
    double& most = is_law.back() ? found.promised.by_a_law : found.promised.by_a_signal;
    most = std::max(most, trial.score);
    if (!is_law.back()) found.promised.left_by_a_signal = std::min(found.promised.left_by_a_signal, trial.promised_left);
  }
  const bool all = among_ == Among::forms, any = found.promised.by_a_law >= found.promised.by_a_signal;
  for (std::size_t i = 0; i < screened.size(); ++i)
    if ((all || (any && is_law[i] && screened[i].score >= least * found.promised.by_a_law)) && may_be_seen(screened[i], base)) found.laws.push_back(std::move(screened[i]));
  return found;
}

/// Whether a law does that was found here before its forms, or by others.
bool LawSearch::list_leaves_nothing() const {
  return !known_.explain.empty() || std::any_of(found_.begin(), found_.end(), [&](const Trial& t) { return !leaves_something_(t); });
}

/// Forms that may explain what laws of the list do not, or as well. Of one that leaves nothing of a mismatch too large for two laws to explain alike only what promises more with no more parameters is a rival.
LawSearch::Prospects LawSearch::rivals_promised() {
  const bool none = base_.reduced_chi2() > nearly_explained && list_leaves_nothing();
  Prospects forms = prospects(base_, screened_beside_base(forms_worth_a_fit(base_, promised_)), promised_, none ? 1 : half_of_it);
  const auto parameters = [&](const Trial& t) { return effect(problem_.rig, t.effects.back()).parameters_on(problem_.rig).size(); };
  const Trial* best = !found_.empty() ? &found_.front() : !known_.explain.empty() ? &known_.explain.front() : nullptr;
  if (none) std::erase_if(forms.laws, [&](const Trial& t) { return parameters(t) > parameters(*best); });
  return forms;
}

/// The same of those that the decays ask for: where a law of the list leaves nothing only formulas with more evidence, and none where a signal promises more than any law to first order, unless a curve is among them.
LawSearch::Prospects LawSearch::rivals_asked_for() {
  const bool is_explained_by_list = !has_curve_ && list_leaves_nothing();  // noise of a colour takes up what another law leaves
  std::vector<std::string> ids;
  keep_laws_of(base_);
  for (const AskedFor& a : asked_) {
    if (is_among(base_.effects, a.form.law.id())) continue;
    if (!a.form.listed.empty()) {
      if (is_explained_by_list) break;  // only forms with more evidence than any law of the list
      continue;
    }
    if (is_explained_by_list && coefficients_of(a.form.law).size() > 1) continue;  // curves are for what no formula explains
    problem_.rig.laws.push_back(as_effect(a.form));
    ids.push_back(a.form.law.id());
  }
  std::vector<Trial> screened = screened_beside_base(ids);
  return has_curve_ ? Prospects{std::move(screened), promised_} : prospects(base_, std::move(screened), promised_, 0);
}

/// By the free decays; runs that are driven from first guesses, in full.
void LawSearch::follow_decays(Trial& trial, const Trial& base, bool from_here) const {
  const bool told = hold_undetermined(trial);
  if (all_driven(base.arrival.joint)) follow_nonlinear(problem_, trial, base, INFINITY);
  else if (nonlinear(trial)) trial.ruled_out = !fit_decays_first(trial, base, from_here);
  if (!told && !trial.ruled_out) hold_undetermined(trial);  // of a spring that gives way, say, from a size at which it does at once
}

/// The simplest first.
void LawSearch::in_order_of_parameters(std::vector<Trial>& tried) const {
  sort_by(tried, [&](const Trial& t) {
    const auto parameters = static_cast<double>(effect(problem_.rig, t.effects.back()).parameters_on(problem_.rig).size());
    return parameters + (decays_decide(t) ? far_dearer : 0) - std::clamp(t.score, 0.0, 1.0);
  });
}

/// Fits in full those that are worth it, and adds them to what was found; where the limits of the search are reached, what the decays have told by then. Of the list, where a mismatch is too large for two laws to explain alike, none behind one that leaves nothing. Forms are all fitted: some are rivals.
/// `from_here`: laws are followed from the sizes at which they stand only.
void LawSearch::follow(std::vector<Trial> tried, const Trial& base, bool from_here) {
  const bool driven = all_driven(base.arrival.joint), by_decays = shows_in_decays(base);
  const bool one_will_do = base.reduced_chi2() > nearly_explained && std::none_of(tried.begin(), tried.end(), [](const Trial& t) { return is_law_id(t.effects.back()); });
  const auto excess = [](const Trial& t) { return std::max(0.0, left_of_decays(t) - 1); };
  const auto follows_decays = [&](const Trial& t) { return !t.ruled_out && (!by_decays || excess(t) < explained - 1); };
  const auto told = [&](const Trial& t) { return by_decays && std::isfinite(t.decays.chi2); };  // near the noise decays are not fitted by themselves
  const auto is_near = [&](const Trial& t) { return !told(t) || left_of_decays(t) < nearly_explained; };  // what leaves more of the decays is at most what another law acts beside
  const std::size_t others = found_.size();
  double least = INFINITY;
  for (const std::vector<Trial>* before : {&known_.explain, &found_})
    for (const Trial& t : *before) least = std::min(least, std::max(excess(t), explained - 1));
  const auto follow_some = [&](std::size_t first, std::size_t& end) {
    if (one_will_do) {
      bool follows = false;
      for (; end < tried.size() && !follows; ++end) {
        follow_decays(tried[end], base, from_here && by_decays);
        follows = follows_decays(tried[end]);
      }
    } else {
      end = tried.size();
      in_parallel(end, [&](std::size_t i) { follow_decays(tried[i], base, from_here && by_decays); });
    }
    // Of thousands of samples twice the excess of another is beyond any evidence.
    for (std::size_t i = first; i < end; ++i)
      if (told(tried[i]) && !tried[i].ruled_out) least = std::min(least, std::max(excess(tried[i]), explained - 1));
    const std::size_t before = found_.size();
    for (std::size_t i = first; i < end; ++i) {
      const bool refuted = tried[i].ruled_out || (told(tried[i]) && excess(tried[i]) > 2 * least);
      (refuted ? refuted_ : found_).push_back(std::move(tried[i]));
    }
    in_parallel(found_.size() - before, [&](std::size_t i) {
      if (!driven && is_near(found_[before + i])) follow_further(found_[before + i], INFINITY);
    });
  };
  try {
    for (std::size_t first = 0, end = 0; first < tried.size(); first = end) {
      follow_some(first, end);
      if (one_will_do && std::any_of(found_.begin() + static_cast<std::ptrdiff_t>(others), found_.end(), leaves_nothing)) break;
    }
  } catch (const OutOfTime&) {
    TimeLimit::lift();
    for (Trial& t : tried)
      if (!t.effects.empty() && !t.ruled_out && std::isfinite(t.decays.chi2)) found_.push_back(std::move(t));
    for (std::size_t i = others; i < found_.size(); ++i) measure(found_[i]);
    throw;
  }
}

/// To first order: then they are tried before any form.
bool LawSearch::signals_leave_nothing(const Promised& promised) const {
  double noise = 0;  // what it makes of chi-square where runs that are not explained are weighted down
  for (std::size_t r = 0; r < base_.variance.size(); ++r) noise += static_cast<double>(base_.arrival.joint.runs()[r].run().samples()) / std::max(1.0, base_.variance[r]);
  return promised.by_a_signal > promised.by_a_law && promised.left_by_a_signal < explained * noise;
}

/// Whether the best asks for another law beside it.
bool LawSearch::goes_on() {
  if (found_.empty() || !known_.explain.empty()) return false;
  const Trial& best = found_.front();
  if (best.effects.size() >= most_effects || runs_away(best) || !leaves_something_(best)) return false;
  const bool takes_from_decays = shows_in_decays(base_) && left_of_decays(best) < half_of_it * left_of_decays(base_);  // other runs may not have been followed
  return (takes_from_decays || bic_difference(best, base_) < 0) && !is_explained(best);
}

/// Whether it leaves nothing, or what noise of a colour or the rig's description explains.
bool LawSearch::is_explained(const Trial& trial) {
  if (is_among(explained_, trial.effects.back())) return true;
  if (leaves_something_(trial) && !(trial.reduced_chi2() < nearly_explained && is_no_law_(trial))) return false;
  explained_.push_back(trial.effects.back());
  return true;
}

/// A search among many ends before the least chi-square of any: where it is near, the first is taken there before it is asked what it leaves. Of runs that are driven, from first guesses with what is known of the law by now.
void LawSearch::settle_first() {
  if (found_.empty() || !known_.explain.empty()) return;
  Trial& best = found_.front();
  if (best.is_settled || !leaves_something_(best) || best.reduced_chi2() > nearly_explained || decays_decide(best) || bic_difference(best, base_) >= 0) return;
  if (all_driven(best.arrival.joint)) fit_from_first_guesses(problem_, best);
  settle(best);
  best = in_finer_steps(with_lost_runs_followed(best));
  best.is_settled = true;
}

std::vector<Trial> LawSearch::search() {
  bool otherwise = false;
  try {
    tell("looking for the law of what is missing" + (base_.effects.empty() ? std::string() : " beside " + base_.effects.back()));
    if (among_ == Among::laws_and_forms) {
      if (goes_by_evidence()) follow_what_decays_ask_for();
      if (!any_explains()) follow_the_list();
      otherwise = !any_explains() && known_.otherwise && known_.otherwise();
    }
    if (!otherwise && !signals_leave_nothing(promised_)) {
      if (shows_in_decays(base_)) look_for_a_curve();
      follow_rivals();
      if (goes_on()) look_for_a_second();
      take_away();
      settle_rivals();
    }
  } catch (const OutOfTime&) {  // what has been fitted stands
    TimeLimit::lift();
  }
  std::erase_if(found_, runs_away);
  sort_by(found_, [&](const Trial& t) { return bic_difference(t, base_); });
  return std::move(found_);
}

/// Far from the noise a step to first order says little.
bool LawSearch::goes_by_evidence() const { return (among_ == Among::laws_and_forms || !known_.explain.empty()) && base_.reduced_chi2() > nearly_explained && shows_in_decays(base_); }

bool LawSearch::any_explains() {
  return !known_.explain.empty() || std::any_of(found_.begin(), found_.end(), [&](const Trial& t) { return is_explained(t); });
}

/// Follows these, and what was found is in order again.
void LawSearch::try_all(std::vector<Trial> trials, const Trial& base, bool from_here) {
  follow(std::move(trials), base, from_here);
  sort_by(found_, [&](const Trial& t) { return bic_difference(t, base_); });
  settle_first();
}

/// What the decays ask for, once.
void LawSearch::ask_decays() {
  if (beside_) return;
  beside_ = beside_unknown_forces(base_.arrival.joint);
  asked_ = asked_along(*beside_);
  keep_most_evident(asked_);
}

/// Laws of the list, each by itself and the first two together; those that are followed in small steps behind all others (follow_the_list).
void LawSearch::follow_what_decays_ask_for() {
  ask_decays();
  std::vector<Trial> alone;
  for (const AskedFor& a : asked_) {
    if (a.form.listed.empty()) continue;
    Trial trial = begun_with({a});
    (decays_decide(trial) ? dear_ : alone).push_back(std::move(trial));
  }
  try_all(std::move(alone), base_, false);
  if (dear_.empty()) try_the_first_two();
}

void LawSearch::try_the_first_two() {
  std::vector<AskedFor> of_list;
  std::copy_if(asked_.begin(), asked_.end(), std::back_inserter(of_list), [](const AskedFor& a) { return !a.form.listed.empty(); });
  if (of_list.size() > 1 && !any_explains()) try_all({begun_with({of_list[0], of_list[1]})}, base_);
}

/// Laws of the list that promise most to first order, as far as the decays have not asked for them.
void LawSearch::follow_the_list() {
  std::vector<std::string> ids = of_the_list(base_);
  std::erase_if(ids, [&](const std::string& id) { return std::any_of(asked_.begin(), asked_.end(), [&](const AskedFor& a) { return a.form.listed == id; }); });
  Prospects laws = prospects(base_, screened_beside_base(ids), {});
  promised_ = laws.promised;
  in_order_of_parameters(laws.laws);
  try_all(std::move(laws.laws), base_);
  if (dear_.empty() || any_explains()) return;
  try_all(std::exchange(dear_, {}), base_, false);
  try_the_first_two();
}

/// A curve, and laws of the list that are asked for along its states, where nothing takes all but a few per cent of the mismatch: what has a name, whatever remains beside it, is no curve.
void LawSearch::look_for_a_curve() {
  if (any_explains() || (!found_.empty() && found_.front().excess() < (1 - enough_to_name) * base_.excess())) return;
  ask_decays();
  has_curve_ = ask_for_a_curve();
  if (!has_curve_) return;
  keep_laws_of(base_);
  std::vector<Trial> listed;
  for (const AskedFor& a : asked_)
    if (!a.form.listed.empty()) listed.push_back(begun_with({a}));
  try_all(std::move(listed), base_, false);
}

/// Forms.
void LawSearch::follow_rivals() {
  asked_forms_ = true;
  if (goes_by_evidence()) ask_decays();
  try_all((goes_by_evidence() || has_curve_ ? rivals_asked_for() : rivals_promised()).laws, base_);
}

/// Beside the best: of the list first, then of the dictionary.
void LawSearch::look_for_a_second() {
  Trial first = found_.front();
  tell("looking for the law of what is missing beside " + first.effects.back());
  if (!first.is_settled && !decays_decide(first) && !all_driven(first.arrival.joint)) settle(first);  // its motions may not have been followed, along which the second is to be seen
  Prospects second = prospects(first, screened_beside(problem_, first, of_the_list(first)), {});
  promised_ = second.promised;
  in_order_of_parameters(second.laws);
  try_all(std::move(second.laws), first);
  if (goes_on()) try_all(prospects(first, screened_beside(problem_, first, forms_worth_a_fit(first, promised_)), promised_).laws, first);
}

/// What a second law made superfluous.
void LawSearch::take_away() {
  if (found_.empty() || found_.front().effects.size() < 2) return;
  problem_.rig.laws = found_.front().arrival.joint.model().rig().laws;
  for (Trial& fewer : taken_away(problem_, found_.front())) found_.push_back(std::move(fewer));
}

/// Rivals are told apart by less than where a search among many ends.
void LawSearch::settle_rivals() {
  in_parallel(found_.size(), [&](std::size_t i) {
    Trial& trial = found_[i];
    if ((leaves_nothing(trial) || (i == 0 && trial.reduced_chi2() < nearly_explained)) && !decays_decide(trial) && !trial.is_settled) settle(trial);
    if (leaves_nothing(trial) && !decays_decide(trial)) leave_out_terms(trial);  // forms have none
  });
}

}  // namespace unrig
